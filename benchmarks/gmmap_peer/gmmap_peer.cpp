// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// GMMap (Li, Karaman and Sze, T-RO 2024) and our map of the same depth images, judged by the same
// pixels, which neither got.
//   gmmap_peer prepare DATA OUT              an RGB-D folder without every 16th pixel in both
//   directions gmmap_peer judge DATA OUT MAP SETTINGS [OCCUPIED]
// MAP is what `planar_map run` made of OUT, SETTINGS an example/*/*.json of GMMap. Something is
// occupied from a probability of OCCUPIED on (0.5), free below 1 - OCCUPIED, unknown at 0.5.
#include <yaml-cpp/yaml.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "gmm_map/map.h"
#include "planar_mapping/io/depth_image.h"
#include "planar_mapping/io/map_file.h"
#include "planar_mapping/io/sequence.h"

namespace fs = std::filesystem;
namespace pm = planar_mapping;

namespace {

constexpr int kStride = 16;  // pixels between those that are held back
constexpr double kMaxRange = 8.0;

bool isHeldBack(int row, int column) {
  return row % kStride == kStride / 2 && column % kStride == kStride / 2;
}

void prepare(const fs::path& data, const fs::path& out) {
  fs::create_directories(out / "depth");
  for (const char* name : {"calib.yaml", "poses.txt"}) fs::copy_file(data / name, out / name);
  if (fs::exists(data / "rgb")) fs::copy(data / "rgb", out / "rgb");
  for (const auto& entry : fs::directory_iterator(data / "depth")) {
    pm::io::DepthImage image = pm::io::readDepthPng(entry.path().string());
    for (std::uint32_t row = 0; row < image.height; ++row) {
      for (std::uint32_t column = 0; column < image.width; ++column) {
        if (isHeldBack(int(row), int(column))) image.values[row * image.width + column] = 0;
      }
    }
    pm::io::writeDepthPng((out / "depth" / entry.path().filename()).string(), image);
  }
}

gmm::map_param readSettings(const std::string& path, const pm::PinholeCamera& camera) {
  const YAML::Node file = YAML::LoadFile(path);
  const YAML::Node fusion = file["gmm_fusion_parameters"];
  const YAML::Node clustering = file["gmm_clustering_parameters"];
  const YAML::Node scanline = clustering["scanline_segmentation"];
  const YAML::Node purge = clustering["spurious_gaussian_purge"];
  gmm::map_param all;
  all.dataset = "tum";  // pixels are projected as there
  all.num_threads = 1;
  all.measure_memory = false;
  all.frame_alg_name = clustering["algorithm"].as<std::string>();
  all.max_depth = float(kMaxRange);
  all.depth_scale = 1;
  all.hell_thresh_squard_free = fusion["hell_thresh_squard_free"].as<float>();
  all.hell_thresh_squard_obs_scale = fusion["hell_thresh_squard_obs_scale"].as<float>();
  all.hell_thresh_squard_oversized_gau = fusion["hell_thresh_squard_oversized_gau"].as<float>();
  all.hell_thresh_squard_min = fusion["hell_thresh_squard_min"].as<float>();
  all.min_gau_len = fusion["min_gau_len"].as<float>();
  all.frame_max_scale = fusion["frame_max_scale"].as<float>();
  all.fusion_max_scale = fusion["fusion_max_scale"].as<float>();
  all.gau_fusion_bd = fusion["gau_fusion_bd"].as<float>();
  all.gau_rtree_bd = fusion["gau_rtree_bd"].as<float>();
  all.track_color = false;
  all.track_intensity = false;
  all.cur_debug_frame = false;
  all.min_num_neighbor_clusters = 4;
  gmm::frame_param& frame = all.gmm_frame_param;
  frame.dataset = all.dataset;
  frame.occ_x_t = scanline["occ_x_t"].as<int>();
  frame.noise_thresh = scanline["noise_thresh"].as<float>();
  frame.ncheck_t = scanline["ncheck_t"].as<int>();
  frame.line_t = scanline["line_t"].as<float>();
  frame.max_incomplete_clusters = scanline["max_incomplete_clusters"].as<int>();
  frame.adaptive_thresh_scale = scanline["adaptive_thresh_scale"].as<float>();
  frame.noise_floor = scanline["noise_floor"].as<float>();
  frame.sparse_t = purge["sparse_t"].as<int>();
  frame.num_line_t = purge["num_line_t"].as<int>();
  frame.num_pixels_t = purge["num_pixels_t"].as<int>();
  frame.angle_t = clustering["segment_fusion"]["angle_t"].as<float>();
  frame.free_space_dist_scale =
      clustering["free_gaussian_generation"]["free_space_dist_scale"].as<float>();
  frame.f = float(std::min(camera.fx, camera.fy));
  frame.fx = float(camera.fx);
  frame.fy = float(camera.fy);
  frame.cx = float(camera.cx);
  frame.cy = float(camera.cy);
  frame.img_width = int(camera.width);
  frame.img_height = int(camera.height);
  frame.debug_row_idx = -1;
  all.updateParameters();
  return all;
}

using State = pm::CellState;

// What held-back pixels say of a map.
struct Judgement {
  std::size_t passed = 0, passed_occupied = 0, passed_free = 0;
  std::size_t ends = 0, ends_covered = 0;
  std::size_t unseen = 0, unseen_unknown = 0;

  void print(const char* name, double file_bytes) const {
    const auto percent = [](std::size_t part, std::size_t all) {
      return all == 0 ? NAN : 100.0 * double(part) / double(all);
    };
    std::printf(
        "%-6s passed: occupied %.2f %%, free %.2f %%; ends covered %.2f %%; unseen unknown %.2f "
        "%%; "
        "%.1f kB\n",
        name, percent(passed_occupied, passed), percent(passed_free, passed),
        percent(ends_covered, ends), percent(unseen_unknown, unseen), file_bytes / 1e3);
  }
};

// Offsets of a ball of 5 cm: what is within it of a point covers the point.
std::vector<pm::Vector3> ball() {
  std::vector<pm::Vector3> offsets{pm::Vector3::Zero()};
  for (int x = -4; x <= 4; ++x) {
    for (int y = -4; y <= 4; ++y) {
      for (int z = -4; z <= 4; ++z) {
        const pm::Vector3 offset = pm::Vector3(x, y, z) * 0.0125;
        if (offset.norm() < 0.0501) offsets.push_back(offset);
      }
    }
  }
  return offsets;
}

template <typename StateAt>
Judgement judge(const pm::io::Sequence& sequence, const StateAt& state_at) {
  const std::vector<pm::Vector3> near = ball();
  Judgement result;
  std::vector<pm::io::Frame> frames;
  pm::Vector3 low = pm::Vector3::Constant(1e9), high = -low;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    frames.push_back(sequence.read(i, pm::io::CloudChannels(), false));
    const pm::io::Frame& frame = frames.back();
    const pm::Pose& pose = frame.T_world_sensor.value();
    for (int row = 0; row < int(frame.cloud.height); ++row) {
      for (int column = 0; column < int(frame.cloud.width); ++column) {
        if (!isHeldBack(row, column)) continue;
        const std::size_t pixel = std::size_t(row) * frame.cloud.width + std::size_t(column);
        const float* const p = &frame.cloud.xyz[3 * pixel];
        const pm::Vector3 point(p[0], p[1], p[2]);
        if (!point.allFinite() || point.z() > kMaxRange) continue;
        const double range = point.norm();
        for (double at = 0.3; at < range - 0.2; at += 0.05) {
          const State state = state_at(pose * (point * (at / range)));
          ++result.passed;
          result.passed_occupied += state == State::Occupied;
          result.passed_free += state == State::Free;
        }
        const pm::Vector3 end = pose * point;
        low = low.cwiseMin(end);
        high = high.cwiseMax(end);
        ++result.ends;
        for (const pm::Vector3& offset : near) {
          if (state_at(end + offset) != State::Occupied) continue;
          ++result.ends_covered;
          break;
        }
      }
    }
  }
  // Space that no view holds, up to a metre outside the ends.
  std::mt19937 random(1);
  for (int i = 0; i < 200000; ++i) {
    pm::Vector3 point;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = std::uniform_real_distribution<double>(low[axis] - 1, high[axis] + 1)(random);
    }
    bool seen = false;
    for (const pm::io::Frame& frame : frames) {
      const pm::Vector3 local = frame.T_world_sensor->inverse() * point;
      if (local.z() <= 0 || !frame.camera) continue;
      const double u = frame.camera->fx * local.x() / local.z() + frame.camera->cx;
      const double v = frame.camera->fy * local.y() / local.z() + frame.camera->cy;
      // a margin of 20 pixels: the sides of Gaussians and cells
      seen = u > -20 && v > -20 && u < frame.camera->width + 20 && v < frame.camera->height + 20;
      if (seen) break;
    }
    if (seen) continue;
    ++result.unseen;
    result.unseen_unknown += state_at(point) == State::Unknown;
  }
  return result;
}

int judgeBoth(const std::string& data, const std::string& given, const std::string& map_file,
              const std::string& settings, double occupied) {
  const pm::io::Sequence truth({data}), input({given});
  std::ostringstream quiet;  // GMMap talks
  auto* const terminal = std::cout.rdbuf(quiet.rdbuf());
  const gmm::map_param parameters = readSettings(settings, input.calibration().value().camera);
  std::atomic<bool> yes{true}, also{true}, fuse{true};
  gmm::GMMMap peer(parameters, &yes, &also, &fuse);
  std::chrono::duration<double, std::milli> time{};
  for (std::size_t i = 0; i < input.size(); ++i) {
    const pm::io::Frame frame = input.read(i, pm::io::CloudChannels(), false);
    gmm::RowMatrixXf depth(frame.cloud.height, frame.cloud.width);
    for (Eigen::Index k = 0; k < depth.size(); ++k) {
      const float z = frame.cloud.xyz[3 * std::size_t(k) + 2];
      depth.data()[k] = std::isfinite(z) ? z : 0.0f;
    }
    gmm::Isometry3 pose(frame.T_world_sensor.value().matrix().cast<float>());
    const auto start = std::chrono::steady_clock::now();
    peer.insertFrame(depth, pose);
    time += std::chrono::steady_clock::now() - start;
  }
  std::cout.rdbuf(terminal);
  std::ostringstream saved;
  peer.save(saved);
  const float evidence =
      YAML::LoadFile(settings)["occupancy_inference_parameters"]["unexplored_evidence"].as<float>();
  const double frames = double(input.size());
  judge(truth, [&](const pm::Vector3& point) {
    const double p = peer.computeOccupancy(point.cast<float>(), evidence);
    if (p > occupied) return State::Occupied;
    return p < 1 - occupied ? State::Free : State::Unknown;
  }).print("GMMap", double(saved.str().size()));
  const pm::PlanarMap map = pm::io::loadMap(map_file);
  judge(truth, [&](const pm::Vector3& point) {
    return map.stateAt(point);
  }).print("ours", double(fs::file_size(map_file)));
  std::printf("GMMap: %d Gaussians, %.1f ms a frame; ours: %zu cuboids\n",
              peer.numOfObsGMMs() + peer.numOfFreeGMMs(), time.count() / frames,
              map.cuboids().size());
  return 0;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string mode = argc > 1 ? argv[1] : "";
  if (mode == "prepare" && argc == 4) {
    prepare(argv[2], argv[3]);
    return 0;
  }
  if (mode == "judge" && (argc == 6 || argc == 7)) {
    return judgeBoth(argv[2], argv[3], argv[4], argv[5], argc == 7 ? std::stod(argv[6]) : 0.5);
  }
  std::fprintf(stderr, "gmmap_peer prepare DATA OUT | judge DATA OUT MAP SETTINGS [OCCUPIED]\n");
  return 2;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
