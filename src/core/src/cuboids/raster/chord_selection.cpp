// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "cuboids/raster/chord_selection.h"

#include <cstddef>

namespace planar_mapping::detail {
namespace {

/// Which vertical chords each horizontal chord meets.
struct Adjacency {
  std::vector<std::size_t> first;  ///< of horizontal chord h: neighbour[first[h]] ...
  std::vector<std::int32_t> neighbour;
};

Adjacency findMeetings(const std::vector<Chord>& horizontal, const std::vector<Chord>& vertical,
                       std::int32_t vertices_x, std::int32_t vertices_y) {
  // Vertical chords by their lowest row; a row sweep keeps the one alive in each column.
  std::vector<std::size_t> row_start(static_cast<std::size_t>(vertices_y) + 1, 0);
  for (const Chord& chord : vertical) ++row_start[static_cast<std::size_t>(chord.from) + 1];
  for (std::size_t y = 1; y < row_start.size(); ++y) row_start[y] += row_start[y - 1];
  std::vector<std::int32_t> by_row(vertical.size());
  std::vector<std::size_t> next(row_start.begin(), row_start.end() - 1);
  for (std::size_t i = 0; i < vertical.size(); ++i) {
    by_row[next[static_cast<std::size_t>(vertical[i].from)]++] = static_cast<std::int32_t>(i);
  }

  Adjacency graph;
  graph.first.reserve(horizontal.size() + 1);
  std::vector<std::int32_t> alive(static_cast<std::size_t>(vertices_x), -1);
  std::int32_t opened_rows = 0;
  for (const Chord& chord : horizontal) {
    for (; opened_rows <= chord.line; ++opened_rows) {
      const auto y = static_cast<std::size_t>(opened_rows);
      for (std::size_t k = row_start[y]; k < row_start[y + 1]; ++k) {
        alive[static_cast<std::size_t>(vertical[static_cast<std::size_t>(by_row[k])].line)] =
            by_row[k];
      }
    }
    graph.first.push_back(graph.neighbour.size());
    for (std::int32_t x = chord.from; x <= chord.to; ++x) {
      const std::int32_t id = alive[static_cast<std::size_t>(x)];
      if (id >= 0 && vertical[static_cast<std::size_t>(id)].to >= chord.line) {
        graph.neighbour.push_back(id);
      }
    }
  }
  graph.first.push_back(graph.neighbour.size());
  return graph;
}

/// Hopcroft and Karp, with an explicit stack: augmenting paths may be as long as the raster allows.
class Matching {
 public:
  Matching(const Adjacency& graph, std::size_t left, std::size_t right)
      : graph_(graph),
        left_(left),
        of_left(left, -1),
        of_right(right, -1),
        depth_(left),
        edge_(left) {}

  void run() {
    matchGreedily();
    while (layer()) {
      for (std::size_t h = 0; h < left_; ++h) edge_[h] = graph_.first[h];
      for (std::size_t h = 0; h < left_; ++h) {
        if (of_left[h] < 0) augmentFrom(static_cast<std::int32_t>(h));
      }
    }
  }

 private:
  void matchGreedily() {
    for (std::size_t h = 0; h < left_; ++h) {
      for (std::size_t e = graph_.first[h]; e < graph_.first[h + 1]; ++e) {
        const auto v = static_cast<std::size_t>(graph_.neighbour[e]);
        if (of_right[v] >= 0) continue;
        of_right[v] = static_cast<std::int32_t>(h);
        of_left[h] = graph_.neighbour[e];
        break;
      }
    }
  }

  /// Distance of each left vertex from the free ones; true if some free right vertex is reached.
  bool layer() {
    bool reached = false;
    queue_.clear();
    for (std::size_t h = 0; h < left_; ++h) {
      depth_[h] = of_left[h] < 0 ? 0 : -1;
      if (of_left[h] < 0) queue_.push_back(static_cast<std::int32_t>(h));
    }
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      const auto h = static_cast<std::size_t>(queue_[i]);
      for (std::size_t e = graph_.first[h]; e < graph_.first[h + 1]; ++e) {
        const std::int32_t mate = of_right[static_cast<std::size_t>(graph_.neighbour[e])];
        if (mate < 0) {
          reached = true;
        } else if (depth_[static_cast<std::size_t>(mate)] < 0) {
          depth_[static_cast<std::size_t>(mate)] = depth_[h] + 1;
          queue_.push_back(mate);
        }
      }
    }
    return reached;
  }

  void augmentFrom(std::int32_t root) {
    stack_.assign(1, root);
    while (!stack_.empty()) {
      const auto h = static_cast<std::size_t>(stack_.back());
      if (edge_[h] == graph_.first[h + 1]) {
        stack_.pop_back();
        if (!stack_.empty()) ++edge_[static_cast<std::size_t>(stack_.back())];
        continue;
      }
      const std::int32_t mate = of_right[static_cast<std::size_t>(graph_.neighbour[edge_[h]])];
      if (mate < 0) {
        for (const std::int32_t left : stack_) {  // flip the path: each takes its current edge
          const std::int32_t v = graph_.neighbour[edge_[static_cast<std::size_t>(left)]];
          of_left[static_cast<std::size_t>(left)] = v;
          of_right[static_cast<std::size_t>(v)] = left;
        }
        for (const std::int32_t left : stack_) {
          edge_[static_cast<std::size_t>(left)] = graph_.first[static_cast<std::size_t>(left) + 1];
        }
        return;
      }
      if (depth_[static_cast<std::size_t>(mate)] == depth_[h] + 1) {
        stack_.push_back(mate);
      } else {
        ++edge_[h];
      }
    }
  }

  const Adjacency& graph_;
  const std::size_t left_;

 public:
  std::vector<std::int32_t> of_left;
  std::vector<std::int32_t> of_right;

 private:
  std::vector<std::int32_t> depth_;
  std::vector<std::size_t> edge_;
  std::vector<std::int32_t> queue_;
  std::vector<std::int32_t> stack_;
};

}  // namespace

ChordChoice largestDisjointChords(const std::vector<Chord>& horizontal,
                                  const std::vector<Chord>& vertical, std::int32_t vertices_x,
                                  std::int32_t vertices_y) {
  // Koenig: what alternating paths from unmatched horizontal chords reach is kept (horizontal) or
  // covered (vertical); the other way round for what they do not reach.
  ChordChoice choice{std::vector<char>(horizontal.size(), 0),
                     std::vector<char>(vertical.size(), 1)};
  if (horizontal.empty()) return choice;
  const Adjacency graph = findMeetings(horizontal, vertical, vertices_x, vertices_y);
  Matching matching(graph, horizontal.size(), vertical.size());
  matching.run();

  std::vector<std::size_t> queue;
  for (std::size_t h = 0; h < horizontal.size(); ++h) {
    if (matching.of_left[h] >= 0) continue;
    choice.horizontal[h] = 1;
    queue.push_back(h);
  }
  for (std::size_t i = 0; i < queue.size(); ++i) {
    for (std::size_t e = graph.first[queue[i]]; e < graph.first[queue[i] + 1]; ++e) {
      const auto v = static_cast<std::size_t>(graph.neighbour[e]);
      if (!choice.vertical[v]) continue;
      choice.vertical[v] = 0;
      const auto mate = static_cast<std::size_t>(matching.of_right[v]);
      if (choice.horizontal[mate]) continue;
      choice.horizontal[mate] = 1;
      queue.push_back(mate);
    }
  }
  return choice;
}

}  // namespace planar_mapping::detail
