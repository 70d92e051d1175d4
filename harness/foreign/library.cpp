#include "harness/foreign/library.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cfenv>
#include <cstddef>
#include <filesystem>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

#include "harness/foreign/ascii_line.h"
#include "harness/foreign/content_hash.h"
#include "media/base/parameters.h"

namespace nullmark {
namespace {

std::atomic<bool> loaded = false;

/// Rounding, denormals and traps of the thread, which all floating-point code depends on.
struct FloatingPointMode {
  int rounding = std::fegetround();
#if defined(__x86_64__)
  static constexpr unsigned kFlags = 0x3f;  // exceptions seen; they come and go
  unsigned control = _mm_getcsr() & ~kFlags;
  void restore() const { _mm_setcsr(control); }
#else
  void restore() const {}
#endif
  bool operator==(const FloatingPointMode&) const = default;
};

/// Calls into a library: no exception and no changed floating-point mode comes back from it.
template <class F>
std::int32_t guarded(const char* what, F&& call) {
  const FloatingPointMode before;
  std::int32_t code = NULLMARK_ERROR;
  try {
    code = call();
  } catch (const std::exception& error) {
    throw TrackerFailure(fmt::format("the tracker threw across the C interface in {}: {}", what, ascii_line(error.what())));
  } catch (...) {
    throw TrackerFailure(fmt::format("the tracker threw across the C interface in {}", what));
  }
  if (const FloatingPointMode after; !(after == before)) {
    std::fesetround(before.rounding);
    before.restore();
    throw TrackerFailure(
        fmt::format("the tracker left the thread's rounding mode, denormals or floating-point traps changed in {}; "
                    "expected them as they were",
                    what));
  }
  return code;
}

/// A line that a tracker writes about its failure.
class ErrorText {
 public:
  char* data() { return text_.data(); }
  std::int64_t size() const { return static_cast<std::int64_t>(text_.size()); }
  std::string said() {
    text_.back() = '\0';
    return text_[0] ? fmt::format(": {}", ascii_line(text_.data())) : "";
  }

 private:
  std::array<char, 1024> text_{};
};

class LibrarySession final : public TrackerSession {
 public:
  LibrarySession(const nullmark_tracker& tracker, const std::string& parameters) : tracker_(tracker) {
    ErrorText error;
    const std::int32_t code =
        guarded("create", [&] { return tracker.create(parameters.c_str(), &state_, error.data(), error.size()); });
    if (code != NULLMARK_OK)
      throw TrackerFailure(fmt::format("the tracker refuses its parameters {}{}", parameters, error.said()));
  }
  ~LibrarySession() override {
    try {
      if (tracker_.destroy) guarded("destroy", [&] { return tracker_.destroy(state_), NULLMARK_OK; });
    } catch (const TrackerFailure&) {
      // Its samples are drawn; the floating-point mode is restored.
    }
  }
  LibrarySession(const LibrarySession&) = delete;
  LibrarySession& operator=(const LibrarySession&) = delete;

  nullmark_description describe(std::int32_t quantity, int channels) const {
    nullmark_description told = {};
    told.size = sizeof told;
    told.guarantee = NULLMARK_UNBIASED;
    told.range = NULLMARK_ANY_SIGN;
    if (guarded("describe", [&] { return tracker_.describe(state_, quantity, channels, &told); }) != NULLMARK_OK)
      throw TrackerFailure(fmt::format("the tracker does not describe quantity {} on {} channels", quantity, channels));
    return told;
  }

  bool theory(const nullmark_ray& ray, std::int32_t quantity, std::int32_t channel, double out[4]) override {
    return tracker_.theory &&
           guarded("theory", [&] { return tracker_.theory(state_, &ray, quantity, channel, out); }) == NULLMARK_OK;
  }

  std::int32_t sample(const nullmark_ray& ray, const nullmark_harness& harness, std::uint64_t key, std::uint64_t first,
                      std::int64_t count, std::int32_t quantity, nullmark_result& result) override {
    ErrorText error;
    const std::int32_t code = guarded("sample", [&] {
      return tracker_.sample(state_, &ray, &harness, key, first, count, quantity, &result, error.data(), error.size());
    });
    if (code == NULLMARK_ERROR && !error.said().empty()) throw TrackerFailure("the tracker failed" + error.said());
    return code;
  }

 private:
  const nullmark_tracker& tracker_;
  void* state_ = nullptr;
};

class LibraryTracker final : public ForeignTracker {
 public:
  LibraryTracker(const nullmark_tracker& tracker, std::string parameters, std::uint64_t file_hash)
      : tracker_(tracker), parameters_(std::move(parameters)), describing_(tracker, parameters_) {
    const auto text = [](const char* told) { return told ? ascii_line(told) : std::string(); };
    name = text(tracker.name);
    summary = text(tracker.summary);
    source = text(tracker.source);
    version = text(tracker.version);
    hash = file_hash;
    quantities = tracker.quantities;
    states_theory = tracker.theory != nullptr;
  }

  std::unique_ptr<TrackerSession> session() const override { return std::make_unique<LibrarySession>(tracker_, parameters_); }

  TrackerDescription describe(std::int32_t quantity, int channels) const override {
    const std::lock_guard lock(mutex_);
    const auto [at, fresh] = described_.try_emplace({quantity, channels});
    if (fresh) at->second = checked(describing_.describe(quantity, channels));
    return at->second;
  }

 private:
  const nullmark_tracker& tracker_;
  std::string parameters_;
  LibrarySession describing_;
  mutable std::mutex mutex_;
  mutable std::map<std::pair<std::int32_t, int>, TrackerDescription> described_;
};

using GetTracker = const nullmark_tracker* (*)(std::int32_t, std::int32_t);

/// Every member that this version calls is inside of the struct's size.
void expect_interface(const std::string& path, const nullmark_tracker& tracker) {
  constexpr std::size_t kLeast = offsetof(nullmark_tracker, sample) + sizeof(tracker.sample);
  if (tracker.size < kLeast || tracker.abi < 1 || tracker.abi > NULLMARK_ABI)
    throw ParameterError(
        "file",
        fmt::format("{}: found interface version {} and a tracker of {} bytes; expected version {} and at least {} bytes: "
                    "compile it with this nullmark's nullmark_tracker.h",
                    path, tracker.abi, tracker.size, NULLMARK_ABI, kLeast));
  if (!tracker.name || !tracker.create || !tracker.describe || !tracker.sample)
    throw ParameterError("file", fmt::format("{}: a tracker misses its name, create, describe or sample", path));
  constexpr std::uint32_t kKnown = NULLMARK_TRANSMITTANCE | NULLMARK_OPTICAL_DEPTH | NULLMARK_FREE_PATH;
  if ((tracker.quantities & kKnown) == 0 || (tracker.quantities & ~kKnown) != 0)
    throw ParameterError("file", fmt::format("{}: found quantities {:#x} of tracker \"{}\"; expected bits of {:#x}", path,
                                             tracker.quantities, ascii_line(tracker.name), kKnown));
}

const nullmark_tracker& find(const std::string& path, GetTracker get, const std::string& name) {
  constexpr std::int32_t kMost = 1000;
  std::vector<std::string> names;
  const nullmark_tracker* found = nullptr;
  for (std::int32_t i = 0; i < kMost; ++i) {
    const nullmark_tracker* tracker = nullptr;
    guarded("nullmark_get_tracker", [&] { return tracker = get(NULLMARK_ABI, i), NULLMARK_OK; });
    if (!tracker) break;
    expect_interface(path, *tracker);
    names.push_back(ascii_line(tracker->name));
    if (name == tracker->name || (name.empty() && i == 0)) found = tracker;
  }
  if (names.empty())
    throw ParameterError("file", fmt::format("{}: offers no tracker for interface version {}", path, NULLMARK_ABI));
  if (name.empty() && names.size() > 1)
    throw ParameterError("name",
                         fmt::format("{} has {} trackers; expected one of {}", path, names.size(), fmt::join(names, ", ")));
  if (!found)
    throw ParameterError("name", fmt::format("{} has no tracker \"{}\"; expected {}", path, name, fmt::join(names, " or ")));
  return *found;
}

}  // namespace

bool library_is_loaded() noexcept { return loaded; }

std::shared_ptr<const ForeignTracker> open_library(const std::string& path, const std::string& name,
                                                   const std::string& parameters) {
  if (!std::filesystem::is_regular_file(path))
    throw ParameterError("file",
                         fmt::format("{}: not a file; expected a shared library, its path relative to the configuration", path));
  const std::uint64_t hash = content_hash(path);
  const FloatingPointMode before;
  loaded = true;
  // A path with a slash is never searched for.  It stays open: its code may have left threads and handlers behind.
  void* const handle = ::dlopen(std::filesystem::absolute(path).c_str(), RTLD_NOW | RTLD_LOCAL);
  // A library linked with -ffast-math sets denormals to zero as it is loaded.
  if (const FloatingPointMode after; !(after == before)) {
    before.restore();
    throw ParameterError(
        "file", fmt::format("{}: loading it changes the thread's floating-point mode; link it without -ffast-math", path));
  }
  if (!handle) {
    const char* const why = ::dlerror();
    throw ParameterError("file", fmt::format("{}: cannot be loaded: {}", path, why ? ascii_line(why) : "no reason told"));
  }
  const auto get = reinterpret_cast<GetTracker>(::dlsym(handle, "nullmark_get_tracker"));
  if (!get)
    throw ParameterError("file", fmt::format("{}: has no nullmark_get_tracker; expected a tracker by nullmark_tracker.h", path));
  try {
    return std::make_shared<LibraryTracker>(find(path, get, name), parameters, hash);
  } catch (const TrackerFailure& failure) {
    throw ParameterError("", fmt::format("{}: {}", path, failure.what()));
  }
}

}  // namespace nullmark
