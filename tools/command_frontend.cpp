// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <iostream>
#include <memory>

#include "frame_command.h"
#include "input/network_input.h"
#include "planar_mapping/core/base/error.h"
#include "planar_mapping/pipeline/front_end_source.h"
#if PLANAR_MAPPING_HAS_TRANSPORT
#include "planar_mapping/transport/front_end.h"
#endif

namespace planar_mapping::tools {
namespace {

struct FrontendArguments {
  std::vector<std::string> inputs;
  std::string poses;
  std::string calibration;
  std::string endpoint;
  double timeout = 30.0;
  int threads = -1;
  std::string encoding = "compact";
  std::string keys;
  bool quiet = false;
};

#if PLANAR_MAPPING_HAS_TRANSPORT

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
  if (!arguments.quiet && isatty(STDERR_FILENO) == 1) {
    options.progress = countFrames;
  }
  const FrontEndInput input = {arguments.inputs, arguments.poses, arguments.threads,
                               arguments.calibration};
  const transport::FrontEndResult result = transport::runFrontEnd(
      endpoint, [&input](const std::string& yaml) { return makeFrontEndSource(yaml, input); },
      options);
  if (result.interrupted) {
    std::cerr << "planar_map: interrupted after " << result.frames_sent << " frames\n";
    return kInterrupted;
  }
  if (!arguments.quiet) {
    std::cout << result.frames_sent << " frames sent, " << result.bytes_sent << " bytes\n";
  }
  return kDone;
}

#else

int run(const FrontendArguments&) {
  throw UsageError(
      "frontend: this program was built without ZeroMQ; configure with "
      "-DPLANAR_MAPPING_BUILD_TRANSPORT=ON");
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
  command
      ->add_option("--timeout", arguments->timeout,
                   "Seconds to wait for a mapping side that is not there or went away")
      ->capture_default_str()
      ->check(numberIn(0.01, 1e6));
  command->add_option("-j,--threads", arguments->threads, "Threads, 0 = all cores")
      ->check(CLI::Range(0, 1024));
  command
      ->add_option("--encoding", arguments->encoding,
                   "compact or raw: how clouds travel; both are exact")
      ->capture_default_str()
      ->check(CLI::IsMember({"compact", "raw"}));
  command->add_option("--keys", arguments->keys,
                      "Key file of planar_map keys, where the mapping side has --keys");
  command->add_flag("-q,--quiet", arguments->quiet, "Say nothing but warnings and errors");
  command->callback([arguments, &exit_code]() { exit_code = run(*arguments); });
}

}  // namespace planar_mapping::tools
