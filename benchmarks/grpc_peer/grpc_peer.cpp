// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause

// What gRPC takes to bring frames of 640 x 480 from one process to itself over 127.0.0.1, beside
// benchmark_transport. Not part of the build; docs/dev/front_end_protocol.md has the commands.
//   grpc_peer            in the clear
//   grpc_peer DIR        mutual TLS with DIR/key.pem and DIR/cert.pem (for "localhost")
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "frames.grpc.pb.h"

namespace {

constexpr int kFrames = 50;
constexpr int kMaxBytes = 64 << 20;

std::string read(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Takes the points out of each message, as a mapping side has to.
class MappingSide final : public peer::Mapping::Service {
 public:
  grpc::Status Send(grpc::ServerContext*, grpc::ServerReader<peer::Frame>* reader,
                    peer::Ack* ack) override {
    peer::Frame frame;
    while (reader->Read(&frame)) {
      points_.assign(frame.xyz().begin(), frame.xyz().end());
      ack->set_frames(ack->frames() + 1);
    }
    return grpc::Status::OK;
  }

 private:
  std::vector<float> points_;
};

}  // namespace

int main(int argc, char** argv) {
  std::shared_ptr<grpc::ServerCredentials> server_side = grpc::InsecureServerCredentials();
  std::shared_ptr<grpc::ChannelCredentials> client_side = grpc::InsecureChannelCredentials();
  if (argc > 1) {
    const std::string key = read(std::string(argv[1]) + "/key.pem");
    const std::string certificate = read(std::string(argv[1]) + "/cert.pem");
    grpc::SslServerCredentialsOptions options(
        GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
    options.pem_root_certs = certificate;
    options.pem_key_cert_pairs.push_back({key, certificate});
    server_side = grpc::SslServerCredentials(options);
    client_side = grpc::SslCredentials({certificate, key, certificate});
  }
  MappingSide mapping;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.SetMaxReceiveMessageSize(kMaxBytes);
  builder.AddListeningPort("localhost:0", server_side, &port);
  builder.RegisterService(&mapping);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  if (!server) return 1;
  const auto stub =
      peer::Mapping::NewStub(grpc::CreateChannel("localhost:" + std::to_string(port), client_side));
  const std::vector<float> points(3 * 640 * 480, 1.25f);
  std::size_t bytes = 0;
  for (int run = 0; run < 5; ++run) {
    grpc::ClientContext context;
    peer::Ack ack;
    const auto start = std::chrono::steady_clock::now();
    const auto writer = stub->Send(&context, &ack);
    for (int i = 0; i < kFrames; ++i) {
      peer::Frame frame;  // filled each time, as a front-end has to
      frame.set_position(static_cast<std::uint64_t>(i));
      frame.set_width(640);
      frame.set_height(480);
      frame.mutable_xyz()->Add(points.begin(), points.end());
      for (int k = 0; k < 300; ++k) {
        peer::KeyFeature* feature = frame.add_features();
        feature->set_track(k);
        feature->set_x(1.0);
        feature->set_y(1.0);
        feature->set_z(1.0);
      }
      bytes = frame.ByteSizeLong();
      if (!writer->Write(frame)) break;
    }
    writer->WritesDone();
    const grpc::Status status = writer->Finish();
    const std::chrono::duration<double, std::milli> passed =
        std::chrono::steady_clock::now() - start;
    if (!status.ok() || ack.frames() != kFrames) {
      std::fprintf(stderr, "%s\n", status.error_message().c_str());
      return 1;
    }
    std::printf("%.2f ms a frame, %zu bytes\n", passed.count() / kFrames, bytes);
  }
  return 0;
}
