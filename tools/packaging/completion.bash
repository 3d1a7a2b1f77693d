# Completion for planar_map and planar_map_viewer: commands, options and keys as --help and config list them.
_planar_map() {
  local current=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]} command="" words="" files="" word
  local last=$COMP_CWORD key=""  # of --set, in --set STAGE.KEY = VALUE: bash divides words at "="
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] || { command=$word; break; }
  done
  [[ $command != atlas || $COMP_CWORD -le 2 || ${COMP_WORDS[2]} == -* ]] || command+=" ${COMP_WORDS[2]}"
  if [[ $current == = ]]; then
    current=""
  elif [[ ${COMP_WORDS[last-1]} == = ]]; then
    last=$((last - 1))
  fi
  ((last < COMP_CWORD)) || [[ ${COMP_WORDS[last]} == = ]] && key=${COMP_WORDS[last-1]} last=$((last - 1))
  if [[ ${COMP_WORDS[last-1]} == --set && -n $key ]]; then
    words=$("$program" config --explain "$key" 2>/dev/null | sed -n 's/^ *allowed: //p' |
      sed 's/,\{0,1\} or /,/g; s/, */\n/g' | grep -x '[a-z][a-z_]\+' | sort -u)
    [[ $key != *.enabled ]] || words="true false"
  elif [[ ${COMP_WORDS[last-1]} == --set ]]; then
    words=$("$program" config --defaults 2>/dev/null | awk '
      /^[a-z]+:/ && !/^(version|stages):/ { print $1 }
      /^  - stage:/ { stage = $3; print stage ".enabled:" }
      /^    [a-z]/ { print stage "." $1 }' | sed 's/:$/=/')
    compopt -o nospace 2>/dev/null
  elif [[ $current == -* ]]; then
    words=$("$program" $command --help 2>/dev/null | sed -n 's/^ *\(-[^ ]*\).*/\1/p' | tr ',' '\n')
  elif [[ ( -z $command || $command == atlas ) && ${program##*/} == planar_map ]]; then
    words=$("$program" $command --help 2>/dev/null | sed -n '/^Subcommands:/,$s/^  \([a-z]\+\) .*/\1/p')
  else
    files=yes
    [[ $COMP_CWORD -eq 2 && $command == @(run|validate|evaluate) ]] &&
      words=$(ls "$(dirname "$(type -P "$program")")/../share/planar_mapping/config" 2>/dev/null)
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"; [[ -z $files ]] || compgen -f -- "$current")
}
complete -o filenames -F _planar_map planar_map planar_map_viewer
