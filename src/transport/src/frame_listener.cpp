// SPDX-FileCopyrightText: planar_mapping contributors
// SPDX-License-Identifier: BSD-3-Clause
#include "planar_mapping/transport/frame_listener.h"

#include <fcntl.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <sstream>
#include <thread>

#include "duration.h"
#include "stream_socket.h"

namespace planar_mapping::transport {
namespace {

using detail::ListenerSession;

constexpr double kTickInterval = 0.05;  // seconds between looks at deadlines and at the stop flag
constexpr double kGoodbyeTime = 0.3;    // seconds that peers have to read the last message
constexpr int kChunksBetweenFlushes = 64;  // answers go out even while a peer floods us

/// Wakes a thread that waits for a socket.
class WakePipe {
 public:
  WakePipe() {
    if (::pipe2(ends_, O_CLOEXEC | O_NONBLOCK) != 0) throw InputError("no pipe can be had");
  }
  ~WakePipe() {
    ::close(ends_[0]);
    ::close(ends_[1]);
  }
  WakePipe(const WakePipe&) = delete;
  WakePipe& operator=(const WakePipe&) = delete;

  int descriptor() const { return ends_[0]; }
  void wake() {
    const char byte = 0;
    [[maybe_unused]] const ssize_t written = ::write(ends_[1], &byte, 1);  // full wakes as well
  }
  void drain() {
    char bytes[64];
    while (::read(ends_[0], bytes, sizeof(bytes)) > 0) continue;
  }

 private:
  int ends_[2] = {-1, -1};
};

}  // namespace

struct FrameListener::Impl {
  Impl(const Endpoint& where, ListenerOptions asked)
      : options(std::move(asked)), session(options.settings, detail::Clock::now()) {
    endpoint = socket.bind(where);
    thread = std::thread([this]() { serve(); });
  }
  ~Impl() {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      session.close(goodbye(), detail::Clock::now());
      quit = true;
    }
    wake.wake();
    thread.join();
  }

  // In the thread that serves; it alone touches the socket.
  void serve();
  void receiveAll();
  void flush();

  // In the mapper's thread.
  bool stopRequested() const { return options.stop != nullptr && *options.stop; }
  Bye goodbye() const;
  void sayEvents(std::unique_lock<std::mutex>& lock);
  template <typename Condition>
  void waitFor(std::unique_lock<std::mutex>& lock, const Condition& condition);
  const Ready* waitForInput();

  ListenerOptions options;
  Endpoint endpoint;
  detail::StreamSocket socket;
  WakePipe wake;

  std::mutex mutex;
  std::condition_variable changed;
  ListenerSession session;  // guarded by mutex
  bool quit = false;        // guarded by mutex
  std::string broken;       // guarded by mutex: why the serving thread ended
  std::optional<Ready> input;
  std::thread thread;
};

void FrameListener::Impl::serve() {
  try {
    std::optional<detail::Clock::time_point> quit_at;
    for (;;) {
      socket.wait(kTickInterval, wake.descriptor());
      wake.drain();
      receiveAll();
      flush();
      changed.notify_all();
      const std::lock_guard<std::mutex> lock(mutex);
      const auto now = detail::Clock::now();
      if (quit && !quit_at) quit_at = now + detail::seconds(kGoodbyeTime);
      if (quit_at && (now >= *quit_at || !session.hasConnections())) return;
    }
  } catch (const std::exception& error) {
    const std::lock_guard<std::mutex> lock(mutex);
    broken = error.what();
    changed.notify_all();
  }
}

void FrameListener::Impl::receiveAll() {
  for (int i = 0; i < kChunksBetweenFlushes; ++i) {
    const std::optional<detail::StreamEvent> event = socket.receive();
    if (!event) return;
    const std::lock_guard<std::mutex> lock(mutex);
    const auto now = detail::Clock::now();
    switch (event->kind) {
      case detail::StreamEvent::Kind::Connected:
        session.connected(event->peer, now);
        break;
      case detail::StreamEvent::Kind::Disconnected:
        session.disconnected(event->peer, now);
        break;
      case detail::StreamEvent::Kind::Data:
        session.received(event->peer, event->data.data<std::uint8_t>(), event->data.size(), now);
        break;
    }
  }
}

void FrameListener::Impl::flush() {
  std::vector<ListenerSession::Outgoing> outgoing;
  {
    const std::lock_guard<std::mutex> lock(mutex);
    session.tick(detail::Clock::now());
    outgoing = session.takeOutgoing();
  }
  for (const ListenerSession::Outgoing& item : outgoing) {
    if (socket.send(item.peer, item.bytes.data(), item.bytes.size())) continue;
    const std::lock_guard<std::mutex> lock(mutex);
    session.disconnected(item.peer, detail::Clock::now());
  }
}

Bye FrameListener::Impl::goodbye() const {
  if (session.state() == ListenerSession::State::Ended) return {ByeReason::Done, ""};
  if (stopRequested()) return {ByeReason::Interrupted, "the mapping side was interrupted"};
  return {ByeReason::Failed,
          "the mapping side ended before the last frame; it says why on its own screen"};
}

void FrameListener::Impl::sayEvents(std::unique_lock<std::mutex>& lock) {
  const std::vector<std::string> events = session.takeEvents();
  if (events.empty() || !options.say) return;
  lock.unlock();
  for (const std::string& event : events) options.say(event);
  lock.lock();
}

/// Until the condition holds, the session is over or a stop is asked for.
template <typename Condition>
void FrameListener::Impl::waitFor(std::unique_lock<std::mutex>& lock, const Condition& condition) {
  for (;;) {
    sayEvents(lock);
    if (!broken.empty()) throw InputError("the network cannot be used: " + broken);
    if (condition() || stopRequested()) return;
    if (session.state() == ListenerSession::State::Failed) throw InputError(session.failure());
    if (session.state() == ListenerSession::State::Ended) return;
    changed.wait_for(lock, detail::seconds(kTickInterval));
  }
}

const Ready* FrameListener::Impl::waitForInput() {
  std::unique_lock<std::mutex> lock(mutex);
  waitFor(lock, [this]() { return session.input().has_value(); });
  if (!input) input = session.input();
  return input ? &*input : nullptr;
}

FrameListener::FrameListener(const Endpoint& endpoint, ListenerOptions options)
    : impl_(std::make_unique<Impl>(endpoint, std::move(options))) {}

FrameListener::~FrameListener() = default;

const Endpoint& FrameListener::endpoint() const {
  return impl_->endpoint;
}

std::vector<std::string> FrameListener::names() const {
  const Ready* input = impl_->waitForInput();
  const std::string address = "front-end at " + toText(impl_->endpoint);
  return {input != nullptr ? address + " (" + input->name + ")" : address};
}

io::SequenceKind FrameListener::kind() const {
  const Ready* input = impl_->waitForInput();
  return input != nullptr ? input->kind : impl_->options.expected;
}

io::PoseSource FrameListener::poseSource() const {
  const Ready* input = impl_->waitForInput();
  return input != nullptr ? input->pose_source : io::PoseSource::File;
}

std::optional<std::size_t> FrameListener::size() const {
  const std::lock_guard<std::mutex> lock(impl_->mutex);
  if (!impl_->session.input()) return std::nullopt;
  return impl_->session.input()->frames;
}

std::optional<Frame> FrameListener::next() {
  std::unique_lock<std::mutex> lock(impl_->mutex);
  std::optional<Frame> frame;
  impl_->waitFor(lock, [&]() {
    frame = impl_->session.takeFrame(detail::Clock::now());
    return frame.has_value();
  });
  if (!frame) impl_->session.close(impl_->goodbye(), detail::Clock::now());
  lock.unlock();
  impl_->wake.wake();
  return frame;
}

std::string frontEndYaml(const Configuration& configuration) {
  std::size_t wanted = 1;
  for (std::size_t i = 0; i < configuration.stages.size(); ++i) {
    const StageKind kind = configuration.stages[i].kind;
    if (kind == StageKind::Images || kind == StageKind::Features) wanted = i + 1;
  }
  std::istringstream lines(effectiveYaml(configuration));
  std::string yaml;
  bool keeps = true;
  std::size_t stages = 0;
  for (std::string line; std::getline(lines, line);) {
    const bool is_top_level = !line.empty() && line.front() != ' ';
    if (is_top_level) {
      const std::string key = line.substr(0, line.find(':'));
      keeps = key != "inputs" && key != "poses" && key != "plugins" && key != "threads";
    } else if (line.compare(0, 10, "  - stage:") == 0 && ++stages > wanted) {
      keeps = false;
    }
    if (keeps) yaml += line + "\n";
  }
  return yaml;
}

}  // namespace planar_mapping::transport
