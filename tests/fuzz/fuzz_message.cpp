// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// A message of the front-end protocol: a byte for what is read of it, then its body.
#include "fuzz.h"
#include "planar_mapping/transport/message.h"

using namespace planar_mapping;
using namespace planar_mapping::transport;

namespace {

constexpr std::size_t kMaxBytes = 1000000;

template <typename Message>
void repeat(ByteReader reader) {
  Message message;
  if (!fuzz::succeeds([&] { message = decode<Message>(reader); })) return;
  const Bytes bytes = encode(message);
  ByteReader again(bytes.data(), bytes.size());
  fuzz::require(encode(decode<Message>(again)) == bytes, "a message survives the wire");
}

void repeatFrame(ByteReader reader) {
  Frame frame;
  if (!fuzz::succeeds([&] { frame = decodeFrame(reader, kMaxBytes); })) return;
  fuzz::require(frame.cloud->size() == std::size_t{frame.cloud->width} * frame.cloud->height,
                "a cloud of the size it says");
  for (const auto encoding : {CloudEncoding::Raw, CloudEncoding::Compact}) {
    const Bytes bytes = encodeFrame({}, 0, frame, encoding);
    ByteReader again(bytes.data(), bytes.size());
    decode<InputDescription>(again);
    decode<Count>(again);
    fuzz::require(encodeFrame({}, 0, decodeFrame(again, kMaxBytes), encoding) == bytes,
                  "a frame survives the wire");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const unsigned kind = input.below(6);
  const std::string body = input.rest();
  const ByteReader reader(body.data(), body.size());
  if (kind == 0) {
    Received received;
    received.envelope = zmq::message_t(body);
    fuzz::succeeds([&] { received.open(); });
  }
  if (kind == 1) repeat<Welcome>(reader);
  if (kind == 2) repeat<Count>(reader);
  if (kind == 3) repeat<Bye>(reader);
  if (kind == 4) repeat<InputDescription>(reader);
  if (kind == 5) repeatFrame(reader);
  return 0;
}
