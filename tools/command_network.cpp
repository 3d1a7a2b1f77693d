// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>

#include "frame_command.h"
#include "planar_mapping/base/error.h"
#include "planar_mapping/base/spelling.h"
#include "planar_mapping/io/atomic_file.h"
#include "planar_mapping/pipeline/front_end_source.h"
#if PLANAR_MAPPING_HAS_TRANSPORT
#include "planar_mapping/transport/frame_listener.h"
#include "planar_mapping/transport/front_end.h"
#endif

// Frames from a front-end on another machine: its command, their keys, and how a run listens.
namespace planar_mapping::tools {
namespace {

struct FrontendArguments : FrontEndInput {
  std::string endpoint;
  double timeout = 30.0;
  std::string encoding = "compact";
  std::string keys;
  bool quiet = false;
};

struct KeysArguments {
  std::string output;
  std::string name = "frontend";
  bool force = false;
};

#if PLANAR_MAPPING_HAS_TRANSPORT

/// Lines `secret KEY`, `public KEY` and `peer KEY` (one or more), as `planar_map keys` writes them.
/// \throws IoError; InputError if it is no key file or others can read it
transport::Keys readKeyFile(const std::string& path) {
  std::ifstream in(path);
  struct stat status {};
  if (!in || ::stat(path.c_str(), &status) != 0) throw IoError(path, "cannot be read");
  if ((status.st_mode & 077U) != 0)
    throw InputError(path + ": others can read this key; chmod 600 it");
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
  if (!sound || keys.secret_key.empty() || keys.public_key.empty() || keys.peers.empty())
    throw InputError(path + ": this is no key file; make one with 'planar_map keys -o DIR'");
  return keys;
}

transport::Endpoint endpointOf(const FrontendArguments& arguments) {
  try {
    const transport::Endpoint endpoint = transport::parseEndpoint(arguments.endpoint);
    if (endpoint.port == 0 && !endpoint.isIpc()) throw InputError("port 0 is to listen only");
    return endpoint;
  } catch (const InputError& error) {
    throw UsageError(std::string("--connect: ") + error.what());
  }
}

int run(const FrontendArguments& arguments) {
  const transport::Endpoint endpoint = endpointOf(arguments);
  transport::FrontEndOptions options;
  options.timeout = arguments.timeout;
  options.encoding = arguments.encoding == "raw" ? transport::CloudEncoding::Raw
                                                 : transport::CloudEncoding::Compact;
  if (!arguments.keys.empty()) options.keys = readKeyFile(arguments.keys);
  options.stop = &stopOnSignal();
  options.say = [](const std::string& text) { std::cerr << "planar_map: " << text << std::endl; };
  if (!arguments.quiet && isatty(STDERR_FILENO) == 1) options.progress = countFrames;
  const transport::FrontEndResult result = transport::runFrontEnd(
      endpoint,
      [&arguments](const std::string& yaml) { return makeFrontEndSource(yaml, arguments); },
      options);
  if (result.interrupted) {
    std::cerr << "planar_map: interrupted after " << detail::counted(result.frames_sent, "frame")
              << "\n";
    return kInterrupted;
  }
  if (!arguments.quiet)
    std::cout << detail::counted(result.frames_sent, "frame") << " sent, " << result.bytes_sent
              << " bytes\n";
  return kDone;
}

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

#else

[[noreturn]] void failWithoutTransport(const std::string& what) {
  throw UsageError(what +
                   ": this program was built without ZeroMQ; configure with "
                   "-DPLANAR_MAPPING_BUILD_TRANSPORT=ON");
}

int run(const FrontendArguments&) {
  failWithoutTransport("frontend");
}

int run(const KeysArguments&) {
  failWithoutTransport("keys");
}

#endif

}  // namespace

void addFrontendCommand(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "frontend", "Images to clouds and features, sent to a run --listen elsewhere");
  const auto arguments = std::make_shared<FrontendArguments>();
  addInputOption(*command, arguments->inputs, arguments->poses, arguments->calibration);
  command->get_option("--input")->required();
  command
      ->add_option("--connect", arguments->endpoint,
                   "[HOST:]PORT or ipc://PATH of the mapping side; only a port = 127.0.0.1")
      ->required();
  addChecked(*command, "--timeout", arguments->timeout, numberIn(0.01, 1e6),
             "Seconds to wait for a mapping side that is not there or went away");
  command->add_option("-j,--threads", arguments->threads, "Threads, 0 = all cores")
      ->check(CLI::Range(0, 1024));
  addChecked(*command, "--encoding", arguments->encoding, CLI::IsMember({"compact", "raw"}),
             "compact or raw: how clouds travel; both are exact");
  command->add_option("--keys", arguments->keys,
                      "Key file of planar_map keys, where the mapping side has --keys");
  command->add_flag("-q,--quiet", arguments->quiet, "Say nothing but warnings and errors");
  command->callback([arguments, &exit_code]() { exit_code = run(*arguments); });
}

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

void addListenOptions(CLI::App& command, ListenArguments& arguments) {
  auto* listen = command.add_option("--listen", arguments.endpoint,
                                    "[HOST:]PORT or ipc://PATH to wait at for a front-end in place "
                                    "of -i; only a port = 127.0.0.1, port 0 = any free one");
  listen->excludes(command.get_option("--input"))->excludes(command.get_option("--poses"));
  addChecked(command, "--timeout", arguments.timeout, numberIn(0.01, 1e6),
             "Seconds without a frame of the front-end after which the run ends")
      ->needs(listen);
  addChecked(command, "--max-message-mb", arguments.max_message_mb, numberIn(0.0625, 4095.0),
             "Largest frame taken from the network, MiB")
      ->needs(listen);
  command
      .add_option("--keys", arguments.keys,
                  "Key file of planar_map keys: encrypt, and admit its front-ends only")
      ->needs(listen);
  command
      .add_flag("--insecure", arguments.insecure,
                "Listen to other machines without keys: whoever reaches the port may send frames")
      ->needs(listen);
}

std::unique_ptr<FrameSource> listenForFrontEnd(const ListenArguments& arguments,
                                               const Configuration& configuration,
                                               const std::atomic<bool>& stop) {
#if PLANAR_MAPPING_HAS_TRANSPORT
  transport::Endpoint endpoint;
  try {
    endpoint = transport::parseEndpoint(arguments.endpoint);
  } catch (const InputError& error) {
    throw UsageError(std::string("--listen: ") + error.what());
  }
  transport::ListenerOptions options;
  if (!arguments.keys.empty()) options.keys = readKeyFile(arguments.keys);
  if (arguments.keys.empty() && !transport::isLoopback(endpoint)) {
    if (!arguments.insecure)
      throw UsageError("--listen " + arguments.endpoint +
                       " is open to other machines: make keys with 'planar_map keys -o DIR' and "
                       "give --keys DIR/mapper.key, or take the risk with --insecure");
    std::cerr << "planar_map: warning: without --keys whoever reaches " << arguments.endpoint
              << " can read and send frames" << std::endl;
  }
  options.configuration = frontEndYaml(configuration);
  options.timeout = arguments.timeout;
  options.max_frame =
      static_cast<std::size_t>(arguments.max_message_mb * static_cast<double>(1U << 20U));
  options.stop = &stop;
  options.expected = hasStage(configuration, StageKind::Images) ? io::SequenceKind::Stereo
                                                                : io::SequenceKind::Clouds;
  options.say = [](const std::string& text) { std::cerr << "planar_map: " << text << std::endl; };
  auto listener = std::make_unique<transport::FrameListener>(endpoint, options);
  std::cerr << "planar_map: listening on " << transport::toText(listener->endpoint()) << std::endl;
  return listener;
#else
  (void)arguments;
  (void)configuration;
  (void)stop;
  failWithoutTransport("--listen");
#endif
}

}  // namespace planar_mapping::tools
