// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
// GMMap (Li, Karaman and Sze, T-RO 2024) and our map of the same depth images, judged by the same
// pixels, which neither got.
//
//   gmmap_peer prepare DATA OUT
//   gmmap_peer judge DATA OUT MAP SETTINGS [OCCUPIED]
//
// OUT is the RGB-D folder DATA without every 16th pixel in both directions, MAP what `planar_map
// run` made of OUT, SETTINGS an example/*/*.json of GMMap. Something is occupied above a
// probability of OCCUPIED (0.5), free below 1 - OCCUPIED, else unknown.
#include <yaml-cpp/yaml.h>

#include <algorithm>
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
#include "planar_mapping/io/layouts/sequence.h"
#include "planar_mapping/io/map_file.h"

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

gmm::map_param parametersOf(const YAML::Node& file, const pm::PinholeCamera& camera) {
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
    std::printf("%-6s passed: occupied %.2f %%, free %.2f %%; ends covered %.2f %%; ", name,
                percent(passed_occupied, passed), percent(passed_free, passed),
                percent(ends_covered, ends));
    std::printf("unseen unknown %.2f %%; %.1f kB\n", percent(unseen_unknown, unseen),
                file_bytes / 1e3);
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

// Where a frame was, and the points of its pixels that were held back, in its own frame.
struct View {
  pm::Pose pose;
  std::vector<pm::Vector3> points;
};

std::vector<View> readViews(const pm::io::Sequence& sequence) {
  std::vector<View> views;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    const pm::io::Frame frame = sequence.read(i, pm::io::CloudChannels(), false);
    views.push_back({frame.T_world_sensor.value(), {}});
    for (int row = 0; row < int(frame.cloud.height); ++row) {
      for (int column = 0; column < int(frame.cloud.width); ++column) {
        if (!isHeldBack(row, column)) continue;
        const std::size_t pixel = std::size_t(row) * frame.cloud.width + std::size_t(column);
        const float* const p = &frame.cloud.xyz[3 * pixel];
        const pm::Vector3 point(p[0], p[1], p[2]);
        if (point.allFinite() && point.z() <= kMaxRange) views.back().points.push_back(point);
      }
    }
  }
  return views;
}

bool isSeen(const pm::Vector3& point, const std::vector<View>& views,
            const pm::PinholeCamera& camera) {
  constexpr double kMargin = 20.0;  // pixels: the sides of Gaussians and cells
  return std::any_of(views.begin(), views.end(), [&](const View& view) {
    const pm::Vector3 local = view.pose.inverse() * point;
    if (local.z() <= 0) return false;
    const pm::Vector2 at = camera.project(local);
    return at.x() > -kMargin && at.y() > -kMargin && at.x() < camera.width + kMargin &&
           at.y() < camera.height + kMargin;
  });
}

template <typename StateAt>
Judgement check(const std::vector<View>& views, const pm::PinholeCamera& camera,
                const StateAt& state_at) {
  const std::vector<pm::Vector3> near = ball();
  Judgement result;
  pm::Vector3 low = pm::Vector3::Constant(1e9), high = -low;
  for (const View& view : views) {
    for (const pm::Vector3& point : view.points) {
      const double range = point.norm();
      for (double at = 0.3; at < range - 0.2; at += 0.05) {
        const State state = state_at(view.pose * (point * (at / range)));
        ++result.passed;
        result.passed_occupied += state == State::Occupied;
        result.passed_free += state == State::Free;
      }
      const pm::Vector3 end = view.pose * point;
      low = low.cwiseMin(end);
      high = high.cwiseMax(end);
      ++result.ends;
      result.ends_covered += std::any_of(near.begin(), near.end(), [&](const pm::Vector3& offset) {
        return state_at(end + offset) == State::Occupied;
      });
    }
  }
  // Space that no view holds, up to a metre outside the ends.
  std::mt19937 random(1);
  for (int i = 0; i < 200000; ++i) {
    pm::Vector3 point;
    for (int axis = 0; axis < 3; ++axis) {
      point[axis] = std::uniform_real_distribution<double>(low[axis] - 1, high[axis] + 1)(random);
    }
    if (isSeen(point, views, camera)) continue;
    ++result.unseen;
    result.unseen_unknown += state_at(point) == State::Unknown;
  }
  return result;
}

int judgeBoth(const std::string& data, const std::string& given, const std::string& map_file,
              const std::string& settings_file, double occupied) {
  const pm::io::Sequence input({given});
  const pm::PinholeCamera camera = input.calibration().value().camera;
  const std::vector<View> views = readViews(pm::io::Sequence({data}));
  const YAML::Node settings = YAML::LoadFile(settings_file);
  std::ostringstream quiet;  // GMMap talks
  auto* const terminal = std::cout.rdbuf(quiet.rdbuf());
  const gmm::map_param parameters = parametersOf(settings, camera);
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
      settings["occupancy_inference_parameters"]["unexplored_evidence"].as<float>();
  const Judgement of_peer = check(views, camera, [&](const pm::Vector3& point) {
    const double p = peer.computeOccupancy(point.cast<float>(), evidence);
    if (p > occupied) return State::Occupied;
    return p < 1 - occupied ? State::Free : State::Unknown;
  });
  of_peer.print("GMMap", double(saved.str().size()));
  const pm::PlanarMap map = pm::io::loadMap(map_file);
  check(views, camera, [&](const pm::Vector3& point) {
    return map.stateAt(point);
  }).print("ours", double(fs::file_size(map_file)));
  std::printf("GMMap: %d Gaussians, %.1f ms a frame; ours: %zu cuboids\n",
              peer.numOfObsGMMs() + peer.numOfFreeGMMs(), time.count() / double(input.size()),
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
