#include "harness/foreign/child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <thread>

#include "harness/foreign/ascii_line.h"
#include "harness/foreign/spawner.h"
#include "media/base/parameters.h"

namespace nullmark {
namespace {

/// Frames that nobody needs: a payload beyond is a fault, whatever the call.
constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr std::size_t kReadAhead = std::size_t{64} << 10;

}  // namespace

Child::Child(const ChildSpec& spec) : spec_(spec), read_ahead_() {
  try {
    start();
  } catch (...) {
    kill();
    throw;
  }
}

Child::~Child() { kill(); }

void Child::start() {
  int sockets[2], errors[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets) != 0)
    throw TrackerFailure(fmt::format("no socket for the tracker's process: {}", std::strerror(errno)));
  socket_ = sockets[0];
  if (::pipe2(errors, O_CLOEXEC) != 0) {
    ::close(sockets[1]);
    throw TrackerFailure(fmt::format("no pipe for the tracker's process: {}", std::strerror(errno)));
  }
  errors_ = errors[0];
  ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  ::fcntl(errors_, F_SETFL, O_NONBLOCK);
  const int room = 1 << 20;
  for (const int end : sockets) ::setsockopt(end, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  if (spec_.shared_memory) {
    memory_ = ::memfd_create("nullmark-tracker", MFD_CLOEXEC);
    void* at = MAP_FAILED;
    if (memory_ >= 0 && ::ftruncate(memory_, kSharedBytes) == 0)
      at = ::mmap(nullptr, kSharedBytes, PROT_READ | PROT_WRITE, MAP_SHARED, memory_, 0);
    if (at != MAP_FAILED) shared_ = static_cast<std::byte*>(at);
  }
  SpawnRequest request;
  request.command = spec_.command;
  request.folder = spec_.folder;
  request.input = request.output = sockets[1];
  request.errors = errors[1];
  request.memory = shared_ ? memory_ : -1;
  request.bytes = static_cast<std::uint64_t>(spec_.gigabytes * 0x1p30);
  const SpawnResult result = spawn(request);
  ::close(sockets[1]);
  ::close(errors[1]);
  process_ = result.process;
  if (result.error != 0) {
    process_ = -1;
    throw ParameterError(
        "command", fmt::format("\"{}\" cannot be started: {}", ascii_line(spec_.command.front()), std::strerror(result.error)));
  }
}

void Child::kill() noexcept {
  if (process_ > 0) {
    ::kill(-process_, SIGKILL);
    while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
  }
  for (int* file : {&socket_, &errors_, &memory_}) {
    if (*file >= 0) ::close(*file);
    *file = -1;
  }
  if (shared_) ::munmap(shared_, kSharedBytes);
  shared_ = nullptr;
}

bool Child::alive() const {
  pollfd file = {socket_, POLLIN, 0};
  // A process that waits for a frame has sent nothing.
  return ::poll(&file, 1, 0) == 0;
}

/// Reads what the process has written to standard error; keeps its last line that is not empty.
void Child::drain() {
  char text[4096];
  for (;;) {
    const ssize_t n = ::read(errors_, text, sizeof text);
    if (n <= 0) return;
    for (const char c : std::string_view(text, static_cast<std::size_t>(n))) {
      if (c != '\n') {
        if (line_.size() < sizeof text) line_ += c;
        continue;
      }
      if (!line_.empty()) last_line_ = line_;
      line_.clear();
    }
  }
}

/// How the process ended; a process that goes on is ended.
std::string Child::ending() {
  using namespace std::chrono_literals;
  int status = 0;
  bool ended = false;
  // Its socket closes a little before the process has ended.
  for (int i = 0; i < 50 && !(ended = ::waitpid(process_, &status, WNOHANG) == process_); ++i) std::this_thread::sleep_for(2ms);
  drain();
  if (!ended) return "";
  // Others of its group may be left.
  ::kill(-process_, SIGKILL);
  process_ = -1;
  if (WIFSIGNALED(status))
    return fmt::format("; it was ended by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)));
  return fmt::format("; it ended with exit code {}", WEXITSTATUS(status));
}

void Child::fail(const std::string& message) {
  std::string text = message + (process_ > 0 ? ending() : "");
  if (!line_.empty()) last_line_ = line_;
  if (!last_line_.empty()) text += fmt::format("; the last line of its standard error: {}", ascii_line(last_line_));
  kill();
  throw TrackerFailure(text);
}

/// Until the socket is ready; standard error is drained meanwhile.
void Child::wait(short events, Clock::time_point deadline) {
  for (;;) {
    pollfd files[2] = {{socket_, events, 0}, {errors_, POLLIN, 0}};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) fail(fmt::format("the tracker's process did not answer in {:g} s", spec_.seconds));
    const int ready = ::poll(files, 2, static_cast<int>(std::min<std::int64_t>(left + 1, 1000)));
    if (ready < 0 && errno != EINTR) fail(fmt::format("the tracker's process cannot be waited for: {}", std::strerror(errno)));
    if (ready <= 0) continue;
    if (files[1].revents & POLLIN) drain();
    // A closed standard error would be ready for ever.
    if (files[1].revents & (POLLHUP | POLLERR) && !(files[1].revents & POLLIN)) {
      pollfd alone = {socket_, events, 0};
      ::poll(&alone, 1, static_cast<int>(std::min<std::int64_t>(left + 1, 1000)));
      files[0].revents = alone.revents;
    }
    if (files[0].revents) return;
  }
}

void Child::send(FrameKind kind, std::span<const std::byte> payload) {
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(spec_.seconds));
  FrameHeader header;
  header.kind = kind;
  header.bytes = static_cast<std::uint32_t>(payload.size());
  header.sequence = sent_++;
  moved_ += payload.size();
  if (uses_shared_ && payload.size() >= kLeastShared && payload.size() <= kSharedBytes / 2) {
    std::memcpy(shared_, payload.data(), payload.size());
    header.shared = 1;
    payload = {};
  }
  iovec parts[2] = {{&header, sizeof header}, {const_cast<std::byte*>(payload.data()), payload.size()}};
  msghdr message = {};
  message.msg_iov = parts;
  message.msg_iovlen = 2;
  for (std::size_t left = sizeof header + payload.size(); left > 0;) {
    const ssize_t n = ::sendmsg(socket_, &message, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      wait(POLLOUT, deadline);
      continue;
    }
    if (n < 0) fail("the tracker's process closed its input");
    left -= static_cast<std::size_t>(n);
    std::size_t gone = static_cast<std::size_t>(n);
    for (iovec& part : parts) {
      const std::size_t of_part = std::min(gone, part.iov_len);
      part.iov_base = static_cast<std::byte*>(part.iov_base) + of_part;
      part.iov_len -= of_part;
      gone -= of_part;
    }
  }
}

void Child::receive_into(std::byte* to, std::size_t bytes, Clock::time_point deadline) {
  while (bytes > 0) {
    if (ahead_at_ < read_ahead_.size()) {
      const std::size_t n = std::min(bytes, read_ahead_.size() - ahead_at_);
      std::memcpy(to, read_ahead_.data() + ahead_at_, n);
      ahead_at_ += n;
      to += n;
      bytes -= n;
      continue;
    }
    const bool direct = bytes >= kReadAhead;
    if (!direct) read_ahead_.resize(kReadAhead);
    ahead_at_ = 0;
    const ssize_t n = ::recv(socket_, direct ? to : read_ahead_.data(), direct ? bytes : kReadAhead, 0);
    read_ahead_.resize(n > 0 && !direct ? static_cast<std::size_t>(n) : 0);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      if (!uses_shared_ || !patience_.asks_again()) wait(POLLIN, deadline);
      continue;
    }
    if (n <= 0) fail("the tracker's process closed its output");
    patience_.answered();
    if (direct) {
      to += n;
      bytes -= static_cast<std::size_t>(n);
    }
  }
}

Child::Frame Child::receive(std::size_t most_bytes) {
  const auto deadline = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(spec_.seconds));
  FrameHeader header;
  receive_into(reinterpret_cast<std::byte*>(&header), sizeof header, deadline);
  if (header.kind < FrameKind::hello || header.kind > FrameKind::ping)
    fail(
        fmt::format("the tracker's process breaks the protocol: found frame {}; expected 1 to 16 (does it print to its standard "
                    "output?)",
                    static_cast<std::uint32_t>(header.kind)));
  if (header.sequence != received_)
    fail(
        fmt::format("the tracker's process breaks the protocol: found frame number {}; expected {}", header.sequence, received_));
  ++received_;
  moved_ += header.bytes;
  if (header.bytes > std::min(std::max<std::size_t>(most_bytes, 4096), kMostBytes))
    fail(fmt::format("the tracker's process breaks the protocol: found a frame of {} bytes; expected at most {}", header.bytes,
                     std::max<std::size_t>(most_bytes, 4096)));
  payload_.resize(header.bytes);
  if (header.shared) {
    if (!uses_shared_ || header.bytes > kSharedBytes / 2)
      fail("the tracker's process breaks the protocol: a payload in shared memory that was not agreed on");
    // Copied, so that the process cannot change what was checked.
    std::memcpy(payload_.data(), shared_ + kSharedBytes / 2, header.bytes);
  } else {
    receive_into(payload_.data(), payload_.size(), deadline);
  }
  if (header.kind == FrameKind::failed) {
    const std::string said(reinterpret_cast<const char*>(payload_.data()), payload_.size());
    throw TrackerFailure("the tracker failed: " + ascii_line(said));
  }
  return {header.kind, payload_};
}

}  // namespace nullmark
