#include "harness/foreign/process_tracker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include "harness/foreign/ascii_line.h"
#include "harness/foreign/content_hash.h"
#include "harness/foreign/request_answers.h"
#include "harness/foreign/serve.h"
#include "harness/model/hash.h"
#include "media/base/own_executable.h"
#include "media/base/parameters.h"

namespace nullmark {
namespace {

/// Seconds that a process takes for an exchange: of no bytes, and for each byte more.
struct ExchangeCost {
  double empty = 0, byte = 0;
};

/// A process that has greeted.
struct Greeted {
  std::unique_ptr<Child> child;
  Welcome welcome;
  ExchangeCost cost;
};

/// The fastest of several exchanges of so many bytes each way.
double exchange_seconds(Child& child, std::size_t bytes, int times) {
  using Clock = std::chrono::steady_clock;
  const std::vector<std::byte> payload(bytes);
  double least = kInfinity;
  for (int i = 0; i < times; ++i) {
    const auto begun = Clock::now();
    child.send(FrameKind::ping, payload);
    const Child::Frame answer = child.receive(bytes);
    if (answer.kind != FrameKind::values || answer.payload.size() != bytes)
      refuse_frame(fmt::format("found frame {} of {} bytes; expected the bytes of the ping",
                               static_cast<std::uint32_t>(answer.kind), answer.payload.size()));
    least = std::min(least, std::chrono::duration<double>(Clock::now() - begun).count());
  }
  return least;
}

ExchangeCost exchange_cost(Child& child) {
  constexpr std::size_t kMany = 1 << 17;
  const double empty = exchange_seconds(child, 0, 100), many = exchange_seconds(child, kMany, 10);
  return {empty, std::max(0., many - empty) / (2 * kMany)};
}

Greeted greet(const ChildSpec& spec, const std::string& parameters) {
  constexpr std::size_t kMostWelcome = 1 << 16;
  Greeted greeted{std::make_unique<Child>(spec), {}, {}};
  Greeting greeting;
  greeting.shared_bytes = greeted.child->shared_bytes();
  PayloadWriter hello;
  hello.one(greeting);
  hello.text(parameters);
  greeted.child->send(FrameKind::hello, hello.bytes());
  const Child::Frame frame = greeted.child->receive(kMostWelcome);
  if (frame.kind != FrameKind::welcome)
    refuse_frame(fmt::format("found frame {}; expected its welcome", static_cast<std::uint32_t>(frame.kind)));
  greeted.welcome = read_welcome(frame.payload);
  greeted.child->use_shared_memory(greeted.welcome.shared);
  greeted.cost = exchange_cost(*greeted.child);
  return greeted;
}

/// Processes that wait for their next cell.
class Pool {
 public:
  static Pool& instance() {
    // Never destroyed: its processes die with the program.
    static Pool* const pool = new Pool;
    return *pool;
  }

  Greeted take(const ChildSpec& spec, const std::string& parameters) {
    {
      const std::lock_guard lock(mutex_);
      std::vector<Greeted>& idle = idle_[{spec, parameters}];
      while (!idle.empty()) {
        Greeted greeted = std::move(idle.back());
        idle.pop_back();
        if (greeted.child->alive()) return greeted;
      }
    }
    return greet(spec, parameters);
  }

  void give_back(const ChildSpec& spec, const std::string& parameters, Greeted greeted) {
    const std::lock_guard lock(mutex_);
    idle_[{spec, parameters}].push_back(std::move(greeted));
  }

 private:
  std::mutex mutex_;
  std::map<std::pair<ChildSpec, std::string>, std::vector<Greeted>> idle_;
};

class ProcessSession final : public TrackerSession {
 public:
  ProcessSession(ChildSpec spec, std::string parameters)
      : spec_(std::move(spec)), parameters_(std::move(parameters)), process_(Pool::instance().take(spec_, parameters_)) {
    exchanges_before_ = process_.child->exchanges();
    bytes_before_ = process_.child->bytes_moved();
  }
  ~ProcessSession() override {
    if (process_.child) Pool::instance().give_back(spec_, parameters_, std::move(process_));
  }
  ProcessSession(const ProcessSession&) = delete;
  ProcessSession& operator=(const ProcessSession&) = delete;

  const Welcome& welcome() const { return process_.welcome; }

  double seam_seconds() const override {
    if (!process_.child) return 0;
    return process_.cost.empty * static_cast<double>(process_.child->exchanges() - exchanges_before_) +
           process_.cost.byte * static_cast<double>(process_.child->bytes_moved() - bytes_before_);
  }

  void begin_ray(const nullmark_ray& ray) override {
    guarded([&] {
      out_.clear();
      write_ray(ray, out_);
      process_.child->send(FrameKind::ray, out_.bytes());
      return NULLMARK_OK;
    });
  }

  bool theory(const nullmark_ray&, std::int32_t quantity, std::int32_t channel, double out[4]) override {
    if (!process_.welcome.theory) return false;
    bool told = false;
    guarded([&] {
      out_.clear();
      out_.one(quantity);
      out_.one(channel);
      process_.child->send(FrameKind::theory, out_.bytes());
      const Child::Frame frame = process_.child->receive(0);
      if (frame.kind != FrameKind::values) unexpected(frame, "the values of a theory");
      PayloadReader reader(frame.payload);
      told = reader.left() > 0;
      if (told) reader.many(out, 4);
      reader.expect_end();
      return NULLMARK_OK;
    });
    return told;
  }

  std::int32_t sample(const nullmark_ray& ray, const nullmark_harness& harness, std::uint64_t key, std::uint64_t first,
                      std::int64_t count, std::int32_t quantity, nullmark_result& result) override {
    return guarded([&] {
      const SampleRequest request{key, first, count, quantity, 0};
      out_.clear();
      out_.one(request);
      process_.child->send(FrameKind::sample, out_.bytes());
      return serve(ray, harness, static_cast<std::size_t>(count), result);
    });
  }

 private:
  /// What throws costs the process: the next session gets a new one.
  template <class F>
  std::int32_t guarded(F&& f) {
    if (!process_.child) throw TrackerFailure("the tracker's process has ended");
    try {
      return f();
    } catch (...) {
      process_.child.reset();
      throw;
    }
  }

  [[noreturn]] static void unexpected(const Child::Frame& frame, const char* expected) {
    refuse_frame(fmt::format("found frame {}; expected {}", static_cast<std::uint32_t>(frame.kind), expected));
  }

  /// Requests until the result, or until the harness says stop.
  std::int32_t serve(const nullmark_ray& ray, const nullmark_harness& harness, std::size_t count, nullmark_result& result) {
    const auto channels = static_cast<std::size_t>(ray.channels);
    // A marching tracker looks up many points of each sample together.
    const std::size_t most_requests = std::max<std::size_t>(4096, 64 * count);
    const std::size_t most_bytes =
        std::max(8 + most_requests * (3 * sizeof(double) + sizeof(std::uint32_t)), result_bytes(count, channels, true, true));
    RequestAnswers requests(harness, channels);
    for (;;) {
      const Child::Frame frame = process_.child->receive(most_bytes);
      if (frame.kind == FrameKind::result) {
        read_result(frame.payload, count, channels, result);
        return NULLMARK_OK;
      }
      if (frame.kind < FrameKind::lookup || frame.kind > FrameKind::step) unexpected(frame, "a request or the result");
      if (const std::int32_t code = requests.answer(frame.kind, frame.payload, out_); code != NULLMARK_OK) return stop(code);
      process_.child->send(FrameKind::values, out_.bytes());
    }
  }

  std::int32_t stop(std::int32_t code) {
    if (code != NULLMARK_STOP) {
      // It misuses the interface: what it makes of a stop is anybody's guess.
      process_.child.reset();
      return code;
    }
    process_.child->send(FrameKind::stop, {});
    const Child::Frame frame = process_.child->receive(0);
    if (frame.kind != FrameKind::stopped) unexpected(frame, "that it has stopped");
    return code;
  }

  ChildSpec spec_;
  std::string parameters_;
  Greeted process_;
  std::uint32_t exchanges_before_ = 0;
  std::uint64_t bytes_before_ = 0;
  PayloadWriter out_;
};

/// Of the words of a command and of the files that they name.
std::uint64_t command_hash(const ChildSpec& spec) {
  std::uint64_t hash = fnv1a("");
  for (const std::string& word : spec.command) {
    hash = fnv1a(word, hash);
    const auto file = std::filesystem::path(spec.folder) / word;
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) continue;
    const std::uint64_t content = content_hash(file.string());
    hash = fnv1a({reinterpret_cast<const char*>(&content), sizeof content}, hash);
  }
  return hash;
}

class ProcessTracker final : public ForeignTracker {
 public:
  ProcessTracker(ChildSpec spec, std::string parameters, std::uint64_t tracker_hash)
      : spec_(std::move(spec)), parameters_(std::move(parameters)), welcome_(ProcessSession(spec_, parameters_).welcome()) {
    name = welcome_.name;
    summary = welcome_.summary;
    source = welcome_.source;
    version = welcome_.version;
    quantities = welcome_.quantities;
    states_theory = welcome_.theory;
    hash = tracker_hash;
    // Fewer and larger frames.
    block = 4096;
  }

  std::unique_ptr<TrackerSession> session() const override {
    try {
      return std::make_unique<ProcessSession>(spec_, parameters_);
    } catch (const ParameterError& error) {
      throw TrackerFailure(error.what());
    }
  }

  TrackerDescription describe(std::int32_t, int channels) const override {
    return channels == 1 ? welcome_.grey : welcome_.chromatic;
  }

 private:
  ChildSpec spec_;
  std::string parameters_;
  Welcome welcome_;
};

std::shared_ptr<const ForeignTracker> open(const ChildSpec& spec, const std::string& parameters, std::uint64_t hash) {
  try {
    return std::make_shared<ProcessTracker>(spec, parameters, hash);
  } catch (const TrackerFailure& failure) {
    throw ParameterError("", failure.what());
  }
}

}  // namespace

std::shared_ptr<const ForeignTracker> open_process(const ChildSpec& spec, const std::string& parameters) {
  return open(spec, parameters, command_hash(spec));
}

std::shared_ptr<const ForeignTracker> open_isolated_library(const std::string& path, const std::string& name,
                                                            const std::string& parameters, double seconds) {
  if (!std::filesystem::is_regular_file(path))
    throw ParameterError("file",
                         fmt::format("{}: not a file; expected a shared library, its path relative to the configuration", path));
  ChildSpec spec;
  spec.command = {own_executable(), kServeLibrary, std::filesystem::absolute(path).string(), name};
  spec.seconds = seconds;
  return open(spec, parameters, content_hash(path));
}

}  // namespace nullmark
