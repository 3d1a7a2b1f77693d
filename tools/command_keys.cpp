// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "commands.h"
#include "input/network_input.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/io/atomic_file.h"

namespace planar_mapping::tools {

struct KeysArguments {
  std::string output;
  std::string name = "frontend";
  bool force = false;
};

#if PLANAR_MAPPING_HAS_TRANSPORT

transport::Keys readKeyFile(const std::string& path) {
  std::ifstream in(path);
  struct stat status {};
  if (!in || ::stat(path.c_str(), &status) != 0) throw IoError(path, "cannot be read");
  if ((status.st_mode & 077U) != 0) {
    throw InputError(path + ": others can read this key; chmod 600 it");
  }
  transport::Keys keys;
  std::string word;
  std::string key;
  bool sound = true;
  while (in >> word >> key) {
    sound = sound && key.size() == 40;
    if (word == "secret") {
      keys.secret_key = key;
    } else if (word == "public") {
      keys.public_key = key;
    } else if (word == "peer") {
      keys.peers.push_back(key);
    } else {
      sound = false;
    }
  }
  if (!sound || keys.secret_key.empty() || keys.public_key.empty() || keys.peers.empty()) {
    throw InputError(path + ": this is no key file; make one with 'planar_map keys -o DIR'");
  }
  return keys;
}

namespace {

void writeKeyFile(const std::string& path, const transport::Keys& keys) {
  std::string text = "secret " + keys.secret_key + "\npublic " + keys.public_key + "\n";
  for (const std::string& peer : keys.peers) text += "peer " + peer + "\n";
  const mode_t before = ::umask(077);
  io::writeFileAtomically(path, text.data(), text.size(), io::Overwrite::Allow);
  ::umask(before);
}

/// A pair for the front-end, known to the mapping side's, which is made if there is none.
int run(const KeysArguments& arguments) {
  const std::filesystem::path directory = arguments.output;
  const std::string mapper_path = directory / "mapper.key";
  const std::string path = directory / (arguments.name + ".key");
  if (path == mapper_path) throw UsageError("--name: 'mapper' is the mapping side itself");
  requireNew(path, arguments.force);
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (error) throw WriteError(arguments.output + ": " + error.message());
  transport::Keys mapper = std::filesystem::exists(mapper_path, error) ? readKeyFile(mapper_path)
                                                                       : transport::makeKeys();
  if (std::filesystem::exists(path, error)) {  // the key that is replaced is no longer admitted
    const std::string replaced = readKeyFile(path).public_key;
    mapper.peers.erase(std::remove(mapper.peers.begin(), mapper.peers.end(), replaced),
                       mapper.peers.end());
  }
  transport::Keys front_end = transport::makeKeys();
  mapper.peers.push_back(front_end.public_key);
  front_end.peers.push_back(mapper.public_key);
  writeResults([&]() {
    writeKeyFile(path, front_end);
    writeKeyFile(mapper_path, mapper);
  });
  std::cout << mapper_path << ": run CONFIG --listen HOST:PORT --keys " << mapper_path << '\n'
            << path << ": move it to the robot; frontend -i INPUT --connect HOST:PORT --keys "
            << path << '\n';
  return kDone;
}

}  // namespace

#else

namespace {

int run(const KeysArguments&) {
  throw UsageError(
      "keys: this program was built without ZeroMQ; configure with "
      "-DPLANAR_MAPPING_BUILD_TRANSPORT=ON");
}

}  // namespace

#endif

void addKeysCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "keys", "Keys that encrypt a run --listen and admit known front-ends only");
  const auto arguments = std::make_shared<KeysArguments>();
  command
      ->add_option("-o,--output", arguments->output,
                   "Directory of mapper.key and NAME.key; a mapper.key there is extended")
      ->required();
  command->add_option("--name", arguments->name, "Name of the front-end, one for each robot")
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Overwrite NAME.key");
  command->callback([arguments, &exit_code]() { exit_code = run(*arguments); });
}

}  // namespace planar_mapping::tools
