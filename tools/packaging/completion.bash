# Completion for planar_map and planar_map_viewer: commands and options as --help lists them.
_planar_map() {
  local current=${COMP_WORDS[COMP_CWORD]} program=${COMP_WORDS[0]} command="" words="" word
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] || { command=$word; break; }
  done
  if [[ $current == -* ]]; then
    words=$("$program" ${command:+"$command"} --help 2>/dev/null | sed -n 's/^ *\(-[^ ]*\).*/\1/p' | tr ',' '\n')
  elif [[ -z $command && ${program##*/} == planar_map ]]; then
    words=$("$program" --help 2>/dev/null | sed -n '/^Subcommands:/,$s/^  \([a-z]\+\) .*/\1/p')
  elif [[ $COMP_CWORD -eq 2 && $command == @(run|validate|evaluate) ]]; then
    words=$(ls "$(dirname "$(type -P "$program")")/../share/planar_mapping/config" 2>/dev/null)
  fi
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current"; [[ $current == -* || -z $command ]] || compgen -f -- "$current")
}
complete -o filenames -F _planar_map planar_map planar_map_viewer
