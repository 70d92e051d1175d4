#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "harness/foreign/frames.h"
#include "harness/foreign/patience.h"

namespace nullmark {

/// How a tracker's process is started, and what it may take.
struct ChildSpec {
  std::vector<std::string> command;  ///< a first word without a slash is searched for in PATH
  std::string folder;                ///< the working directory
  double seconds = 60;               ///< without a frame from it
  double gigabytes = 0;              ///< of address space; 0: no limit
  bool shared_memory = true;         ///< offered for large payloads

  auto operator<=>(const ChildSpec&) const = default;
};

/// A tracker's process, in a process group of its own that dies with this program.  It reads frames from its standard input and
/// writes frames to its standard output, which are one socket; what it writes to standard error is drained, and its last line
/// kept for messages.  Any fault of it throws TrackerFailure and ends it.
class Child {
 public:
  /// Throws ParameterError if the command cannot be started.
  explicit Child(const ChildSpec& spec);
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  void send(FrameKind kind, std::span<const std::byte> payload);

  struct Frame {
    FrameKind kind;
    std::span<const std::byte> payload;  ///< until the next call
  };
  /// The next frame, of at most `most_bytes`.  A `failed` frame is thrown as TrackerFailure.
  Frame receive(std::size_t most_bytes);

  /// Whether large payloads go through the shared memory, once both sides have agreed.
  void use_shared_memory(bool use) { uses_shared_ = use && shared_; }
  std::uint32_t shared_bytes() const { return shared_ ? kSharedBytes : 0; }

  /// Whether nothing says that the process has ended.
  bool alive() const;

  /// Frames received, and bytes of payload either way.
  std::uint32_t exchanges() const { return received_; }
  std::uint64_t bytes_moved() const { return moved_; }

  /// Throws TrackerFailure: the message, how the process ended, and its last line.
  [[noreturn]] void fail(const std::string& message);

 private:
  static constexpr std::uint32_t kSharedBytes = 16u << 20;
  using Clock = std::chrono::steady_clock;

  void start();
  void receive_into(std::byte* to, std::size_t bytes, Clock::time_point deadline);
  void wait(short events, Clock::time_point deadline);
  void drain();
  std::string ending();
  void kill() noexcept;

  ChildSpec spec_;
  pid_t process_ = -1;
  int socket_ = -1, errors_ = -1, memory_ = -1;
  std::byte* shared_ = nullptr;  ///< this side's half, then the process's
  bool uses_shared_ = false;
  Patience patience_;
  std::uint32_t sent_ = 0, received_ = 0;
  std::uint64_t moved_ = 0;
  std::vector<std::byte> payload_, read_ahead_;
  std::size_t ahead_at_ = 0;
  std::string last_line_, line_;
};

}  // namespace nullmark
