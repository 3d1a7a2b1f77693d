// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "input/network_input.h"

#include <iostream>

#include "commands.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/front_end_source.h"
#if PLANAR_MAPPING_HAS_TRANSPORT
#include "planar_mapping/transport/frame_listener.h"
#endif

namespace planar_mapping::tools {

void addListenOptions(CLI::App& command, ListenArguments& arguments) {
  auto* listen = command.add_option("--listen", arguments.endpoint,
                                    "[HOST:]PORT or ipc://PATH to wait at for a front-end in place "
                                    "of -i; only a port = 127.0.0.1, port 0 = any free one");
  listen->excludes(command.get_option("--input"))->excludes(command.get_option("--poses"));
  command
      .add_option("--timeout", arguments.timeout,
                  "Seconds without a frame of the front-end after which the run ends")
      ->capture_default_str()
      ->check(numberIn(0.01, 1e6))
      ->needs(listen);
  command
      .add_option("--max-message-mb", arguments.max_message_mb,
                  "Largest frame taken from the network, MiB")
      ->capture_default_str()
      ->check(numberIn(0.0625, 4095.0))
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

#if PLANAR_MAPPING_HAS_TRANSPORT

std::unique_ptr<FrameSource> listenForFrontEnd(const ListenArguments& arguments,
                                               const Configuration& configuration,
                                               const std::atomic<bool>& stop) {
  transport::Endpoint endpoint;
  try {
    endpoint = transport::parseEndpoint(arguments.endpoint);
  } catch (const InputError& error) {
    throw UsageError(std::string("--listen: ") + error.what());
  }
  transport::ListenerOptions options;
  if (!arguments.keys.empty()) options.keys = readKeyFile(arguments.keys);
  if (arguments.keys.empty() && !transport::isLoopback(endpoint)) {
    if (!arguments.insecure) {
      throw UsageError("--listen " + arguments.endpoint +
                       " is open to other machines: make keys with 'planar_map keys -o DIR' and "
                       "give --keys DIR/mapper.key, or take the risk with --insecure");
    }
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
}

#else

std::unique_ptr<FrameSource> listenForFrontEnd(const ListenArguments&, const Configuration&,
                                               const std::atomic<bool>&) {
  throw UsageError(
      "--listen: this program was built without ZeroMQ; configure with "
      "-DPLANAR_MAPPING_BUILD_TRANSPORT=ON");
}

#endif

}  // namespace planar_mapping::tools
