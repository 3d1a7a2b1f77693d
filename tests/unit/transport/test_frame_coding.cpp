// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "numbers.h"
#include "planar_mapping/base/random.h"
#include "planar_mapping/transport/message.h"
#include "transport_frames.h"

namespace planar_mapping::transport {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

const InputDescription kInput = {io::SequenceKind::Stereo, io::PoseSource::File, 20, 99, "street"};

Bytes encoded(const Frame& frame, CloudEncoding encoding = CloudEncoding::Compact) {
  return encodeFrame(kInput, 17, frame, encoding);
}
Frame decoded(const Bytes& body, std::size_t max_bytes = kManyBytes) {
  ByteReader reader(body.data(), body.size());
  EXPECT_EQ("street", decode<InputDescription>(reader).name);
  EXPECT_EQ(17U, decode<Count>(reader).frames);
  return decodeFrame(reader, max_bytes);
}
Frame throughTheWire(const Frame& frame, CloudEncoding encoding = CloudEncoding::Compact) {
  return decoded(encoded(frame, encoding));
}
/// Whatever the bytes are.
Frame decodedOrThrown(const Bytes& body) {
  ByteReader reader(body.data(), body.size());
  decode<InputDescription>(reader);
  decode<Count>(reader);
  return decodeFrame(reader, kManyBytes);
}

TEST(FrameCoding, EveryFieldComesBackAsItWas) {
  const Frame sent = transportFrame(32, 24);
  const Frame received = throughTheWire(sent);
  EXPECT_TRUE(received.front_end_done);
  EXPECT_EQ(sent.number, received.number);
  EXPECT_EQ(sent.source, received.source);
  EXPECT_EQ(sent.timestamp, received.timestamp);
  EXPECT_TRUE(sent.pose_assumed && received.pose_assumed);
  EXPECT_TRUE(sent.without_sensor && received.without_sensor);
  EXPECT_EQ(sent.T_world_sensor.matrix(), received.T_world_sensor.matrix());
  ASSERT_TRUE(received.given_pose.has_value());
  EXPECT_EQ(sent.given_pose->matrix(), received.given_pose->matrix());
  ASSERT_TRUE(received.camera.has_value());
  EXPECT_EQ(sent.camera->fx, received.camera->fx);
  EXPECT_EQ(sent.camera->cy, received.camera->cy);
  EXPECT_EQ(32, received.camera->width);
  EXPECT_EQ(0.12, received.baseline.value());
  EXPECT_EQ(sent.points_input, received.points_input);
  EXPECT_EQ(5U, received.features);
  EXPECT_EQ(4U, received.matches);
  ASSERT_EQ(5U, received.key_features.size());
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(sent.key_features[i].track, received.key_features[i].track);
    EXPECT_EQ(sent.key_features[i].sightings, received.key_features[i].sightings);
    EXPECT_EQ(sent.key_features[i].column, received.key_features[i].column);
    EXPECT_EQ(sent.key_features[i].row, received.key_features[i].row);
    EXPECT_TRUE(std::isnan(received.key_features[i].disparity));
    EXPECT_EQ(sent.key_features[i].position, received.key_features[i].position);
  }
  ASSERT_EQ(2U, received.statistics.size());
  EXPECT_EQ("stereo_ms", received.statistics[1].name);
  EXPECT_EQ(12.5, received.statistics[1].value);
  EXPECT_EQ(sent.stage_ms, received.stage_ms);
  EXPECT_EQ(sent.notes, received.notes);
  EXPECT_EQ(sent.warnings, received.warnings);
  EXPECT_TRUE(received.skip_reason.empty());
  EXPECT_TRUE(sameCloud(*sent.cloud, *received.cloud));
}

TEST(FrameCoding, AnyCloudIsExactToTheLastBitInBothEncodings) {
  const float values[] = {0.0F,  -0.0F,  1e-45F, -1e-45F, 3.4e38F, -3.4e38F,
                          1e12F, -1e12F, 1.0F,   -1.0F,   1e-30F,  test::kNanFloat};
  std::vector<Frame> frames = {transportFrame(33, 17), transportFrame(7, 1), transportFrame(0, 0)};
  Frame extreme = transportFrame(4, 3);
  for (std::size_t i = 0; i < 12; ++i)
    extreme.cloud->points[i] = pcl::PointXYZ(values[i], values[11 - i], values[(i + 5) % 12]);
  frames.push_back(extreme);
  Frame bits = transportFrame(16, 16);
  Random random(3);
  for (pcl::PointXYZ& p : bits.cloud->points) {  // any bits whatever
    for (float* value : {&p.x, &p.y, &p.z}) {
      const auto number = static_cast<std::uint32_t>(random.next());
      std::memcpy(value, &number, sizeof(number));
    }
  }
  frames.push_back(bits);
  Frame holes = transportFrame(5, 5);
  holes.cloud->points.assign(25, pcl::PointXYZ(1.0F, kInfinity, test::kNanFloat));
  frames.push_back(holes);
  for (const Frame& frame : frames) {
    for (const CloudEncoding encoding : {CloudEncoding::Raw, CloudEncoding::Compact})
      EXPECT_TRUE(sameCloud(*frame.cloud, *throughTheWire(frame, encoding).cloud));
  }
}

TEST(FrameCoding, CompactIsSmallerForTheCloudOfACamera) {
  const Frame frame = transportFrame(160, 120);
  const double raw = static_cast<double>(encoded(frame, CloudEncoding::Raw).size());
  const double compact = static_cast<double>(encoded(frame).size());
  EXPECT_LT(compact, 0.75 * raw);
}

TEST(FrameCoding, TheLeftImageTravelsInGray) {
  // Without it the mapping side could not compare views, and its poses would be others.
  Frame frame = transportFrame(16, 12);
  frame.images.left = {16, 12, 3, std::vector<std::uint8_t>(16 * 12 * 3)};
  for (std::size_t i = 0; i < frame.images.left.pixels.size(); ++i)
    frame.images.left.pixels[i] = static_cast<std::uint8_t>(7 * i);
  const io::Image gray = io::toGray(frame.images.left);
  const Frame received = throughTheWire(frame);
  EXPECT_EQ(16, received.images.left.width);
  EXPECT_EQ(12, received.images.left.height);
  EXPECT_EQ(1, received.images.left.channels);
  EXPECT_EQ(gray.pixels, received.images.left.pixels);
  EXPECT_TRUE(received.images.right.empty());
  // No view without a camera or of another size than the cloud.
  frame.camera.reset();
  EXPECT_TRUE(throughTheWire(frame).images.left.empty());
  frame = transportFrame(16, 12);
  frame.images.left = {8, 12, 1, std::vector<std::uint8_t>(8 * 12)};
  EXPECT_TRUE(throughTheWire(frame).images.left.empty());
}

TEST(FrameCoding, ValuesOutOfRangeAreRefused) {
  const auto refuses = [](const std::function<void(Frame&)>& change) {
    Frame frame = transportFrame(4, 4);
    change(frame);
    EXPECT_THROW(throughTheWire(frame), InputError);
  };
  refuses([](Frame& f) { f.timestamp = test::kNanFloat; });
  refuses([](Frame& f) { f.T_world_sensor.translation().x() = kInfinity; });
  refuses([](Frame& f) { f.T_world_sensor.linear() *= 1.01; });
  refuses([](Frame& f) { f.T_world_sensor.linear() *= -1.0; });
  refuses([](Frame& f) { f.given_pose->linear().setZero(); });
  refuses([](Frame& f) { f.camera->fx = 0.0; });
  refuses([](Frame& f) { f.camera->cx = test::kNanFloat; });
  refuses([](Frame& f) { f.camera->width = -1; });
  refuses([](Frame& f) { f.baseline = -0.1; });
  refuses([](Frame& f) { f.baseline = test::kNanFloat; });
  refuses([](Frame& f) { f.key_features[2].position.y() = test::kNanFloat; });
  refuses([](Frame& f) { f.key_features[2].track = -1; });
  refuses([](Frame& f) { f.key_features[2].sightings = 0; });
  refuses([](Frame& f) { f.key_features[2].column = kInfinity; });
  refuses([](Frame& f) { f.statistics[0].name = "a,b"; });
  refuses([](Frame& f) { f.statistics.resize(300, {"x", 0.0}); });
  refuses([](Frame& f) { f.stage_ms[0] = -1.0; });
  refuses([](Frame& f) { f.cloud->width = 5; });
  refuses([](Frame& f) { f.cloud.reset(); });
}

TEST(FrameCoding, EveryCutIsAnError) {
  for (const CloudEncoding encoding : {CloudEncoding::Raw, CloudEncoding::Compact}) {
    const Bytes body = encoded(transportFrame(6, 4), encoding);
    for (std::size_t size = 0; size < body.size(); ++size) {
      const Bytes cut(body.begin(), body.begin() + static_cast<std::ptrdiff_t>(size));
      EXPECT_THROW(decodedOrThrown(cut), ProtocolError) << size;
    }
    Bytes longer = body;
    longer.push_back(0);
    EXPECT_THROW(decodedOrThrown(longer), ProtocolError);
  }
}

TEST(FrameCoding, DamagedBodiesThrowOrDecodeToSomethingConsistent) {
  Random random(11);
  int decoded = 0;
  for (int i = 0; i < 6000; ++i) {
    const auto encoding = static_cast<CloudEncoding>(random.below(2));
    Bytes body = encoded(transportFrame(6, 4, 1 + random.below(9)), encoding);
    const std::size_t changes = 1 + random.below(4);
    for (std::size_t k = 0; k < changes; ++k) {
      const std::size_t at = random.below(body.size());
      switch (random.below(4)) {
        case 0:
          body[at] = static_cast<std::uint8_t>(body[at] ^ (1U << random.below(8)));
          break;
        case 1:
          body[at] = 0xFF;
          break;
        case 2:
          body.erase(body.begin() + static_cast<std::ptrdiff_t>(at));
          break;
        default:
          body.insert(body.begin() + static_cast<std::ptrdiff_t>(at), 0x80);
          break;
      }
    }
    try {
      const Frame frame = decodedOrThrown(body);
      ++decoded;
      EXPECT_EQ(frame.cloud->size(), std::size_t{frame.cloud->width} * frame.cloud->height);
      EXPECT_TRUE(frame.T_world_sensor.matrix().allFinite());
      for (const KeyFeature& feature : frame.key_features) {
        EXPECT_TRUE(feature.position.allFinite());
        EXPECT_GE(feature.track, 0);
      }
      EXPECT_NO_THROW(throughTheWire(frame, encoding));
    } catch (const ProtocolError&) {
      continue;
    }
  }
  EXPECT_GT(decoded, 100);  // most changed coordinates are coordinates still
}

TEST(FrameCoding, NoMoreMemoryIsTakenThanTheLimitAndWhatWasSent) {
  Bytes body = encoded(transportFrame(0, 0), CloudEncoding::Raw);
  const std::size_t cloud = body.size() - 13;  // width, height, is_dense; no image
  for (std::size_t i = 0; i < 8; ++i) body[cloud + i] = i % 4 == 2 ? 1 : 0;  // 65536 x 65536
  EXPECT_THROW(decoded(body), ProtocolError);
  for (std::size_t i = 0; i < 8; ++i) body[cloud + i] = 0xFF;
  EXPECT_THROW(decoded(body), ProtocolError);
  for (std::size_t i = 0; i < 4; ++i) body[cloud + i] = 0;  // no column, 4e9 rows
  EXPECT_THROW(decoded(body), ProtocolError);
  Frame frame = transportFrame(100, 100);  // packs well
  frame.cloud->points.assign(10000, pcl::PointXYZ(1.0F, 2.0F, 3.0F));
  body = encoded(frame);
  EXPECT_LT(body.size(), 10000U);
  EXPECT_NO_THROW(decoded(body, 130000));
  EXPECT_THROW(decoded(body, 120000), ProtocolError);
  EXPECT_THROW(encodeFrame(kInput, 17, frame, CloudEncoding::Compact, 120000), InputError);
}

TEST(FrameCoding, NotesAreLimitedInNumberAndLength) {
  Frame frame = transportFrame(4, 4);
  frame.notes.assign(1000, std::string(100000, 'x'));
  const Frame received = throughTheWire(frame);
  EXPECT_EQ(32U, received.notes.size());
  EXPECT_EQ(kMaxText, received.notes.front().size());
}

TEST(FrameCoding, TextsOfAPeerAreOneLineOfPrintableAscii) {
  Frame frame = transportFrame(2, 2);
  frame.notes = {"a\nb\x1B[31m\x7F \xC3\xA9"};
  EXPECT_EQ("a?b?[31m? ??", throughTheWire(frame).notes.front());
}

TEST(FrameCoding, EnvelopesOfOthersAreRefused) {
  const auto open = [](const Bytes& bytes) {
    Received received;
    received.envelope = zmq::message_t(bytes.data(), bytes.size());
    received.open();
    return received.type;
  };
  const Bytes good = {'P', 'M', 'F', 'E', 7, 0, 3, 0, 1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_EQ(MessageType::Frame, open(good));
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_THROW(open(Bytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size))),
                 ProtocolError);
  }
  Bytes bad = good;
  bad[0] = 'G';
  EXPECT_THROW(open(bad), ProtocolError);
  bad = good;
  bad[4] = 1;
  EXPECT_THROW(open(bad), VersionError);
  bad = good;
  bad[6] = 7;
  EXPECT_THROW(open(bad), ProtocolError);
  bad = good;
  bad.push_back(0);
  EXPECT_THROW(open(bad), ProtocolError);
}

}  // namespace
}  // namespace planar_mapping::transport
