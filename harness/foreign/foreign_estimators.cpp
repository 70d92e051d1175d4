#include <fmt/format.h>

#include <filesystem>
#include <mutex>

#include "harness/foreign/consent.h"
#include "harness/foreign/foreign_entry.h"
#include "harness/foreign/foreign_kernel.h"
#include "harness/foreign/library.h"
#include "harness/foreign/process_tracker.h"

namespace nullmark {
namespace {

/// What the two kinds have in common.  The tracker is opened when something is first asked of it, so that reading configurations
/// and results starts nothing.
class ForeignSource : public EstimatorSource {
 public:
  void locate(const std::string& folder) override { folder_ = folder; }

  Guarantee claim(Quantity quantity) const override { return describe(quantity, 1).guarantee; }
  SampleRange range(int channels) const override { return describe(first_quantity(), channels).range; }
  bool needs_bound() const override { return describe(first_quantity(), 1).needs_bound; }
  std::optional<Real> order(Quantity quantity) const override {
    const Real told = describe(quantity, 1).order;
    return told > 0 ? std::optional(told) : std::nullopt;
  }
  void check(const MatterBounds&) const override {}
  std::unique_ptr<const Kernel> kernel(int channels, Precision precision, bool) const override {
    if (precision == Precision::float32) return nullptr;
    return make_foreign_kernel(shared(), channels);
  }
  std::optional<TrackerIdentity> identity() const override {
    const ForeignTracker& told = tracker();
    const TrackerDescription description = describe(first_quantity(), 1);
    return TrackerIdentity{told.name, told.version, told.hash, description.own_medium,
                           description.streams != NULLMARK_STREAMS_FREE};
  }

 protected:
  virtual std::string what() const = 0;
  virtual std::shared_ptr<const ForeignTracker> open() const = 0;

  const std::string& folder() const { return folder_; }
  static constexpr const char* kLabelText = "what tables call the tracker; left out: type and parameters";
  std::string parameters_ = "{}", label_;

 private:
  const std::shared_ptr<const ForeignTracker>& shared() const {
    expect_foreign_code_allowed(what());
    const std::lock_guard lock(mutex_);
    if (!tracker_) tracker_ = open();
    return tracker_;
  }
  const ForeignTracker& tracker() const { return *shared(); }

  Quantity first_quantity() const {
    for (const Quantity quantity : {Quantity::transmittance, Quantity::optical_depth})
      if (tracker().answers(quantity)) return quantity;
    return Quantity::free_path;
  }

  /// Of a quantity that it does not answer nothing is known.
  TrackerDescription describe(Quantity quantity, int channels) const {
    return tracker().answers(quantity) ? tracker().describe(bit_of(quantity), channels) : TrackerDescription{};
  }

  std::string folder_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const ForeignTracker> tracker_;
};

class LibrarySource final : public ForeignSource {
 public:
  static constexpr const char* kName = "library";
  static constexpr const char* kSummary = "a tracker from a shared library, by harness/foreign/nullmark_tracker.h";

  void parameters(ParameterVisitor& visit) override {
    visit.text("file", file_, "the library, relative to the configuration");
    visit.text("name", name_, "of its tracker; left out: its only one");
    visit.object("parameters", parameters_, "what the tracker makes of it");
    visit.text("label", label_, kLabelText);
    visit.flag("isolate", isolate_, "run it in a process of its own, which it may crash");
    visit.number("seconds", seconds_, Range::positive(), "s", "isolated: the longest time without a call from it");
  }

 private:
  std::string what() const override { return "library " + file_; }
  std::shared_ptr<const ForeignTracker> open() const override {
    if (file_.empty()) throw ParameterError("file", "missing; expected the path of a shared library");
    const std::string path = (std::filesystem::path(folder()) / file_).string();
    return isolate_ ? open_isolated_library(path, name_, parameters_, seconds_) : open_library(path, name_, parameters_);
  }

  std::string file_, name_;
  bool isolate_ = false;
  Real seconds_ = 60;
};

class ProcessSource final : public ForeignSource {
 public:
  static constexpr const char* kName = "process";
  static constexpr const char* kSummary = "a tracker in a process of its own, by the frames of harness/foreign/foreign.md";

  void parameters(ParameterVisitor& visit) override {
    visit.texts("command", command_, "program and arguments; it runs in the folder of the configuration");
    visit.object("parameters", parameters_, "what the tracker makes of it");
    visit.text("label", label_, kLabelText);
    visit.number("seconds", seconds_, Range::positive(), "s", "the longest time without a frame from it");
    visit.number("gigabytes", gigabytes_, Range::non_negative(), "GiB", "limit on its address space; 0: none");
    visit.flag("shared_memory", shared_memory_, "offer memory for large frames");
  }

 private:
  std::string what() const override { return "process " + (command_.empty() ? "" : command_.front()); }
  std::shared_ptr<const ForeignTracker> open() const override {
    if (command_.empty() || command_.front().empty())
      throw ParameterError("command", "missing; expected a program and its arguments");
    return open_process({command_, folder(), seconds_, gigabytes_, shared_memory_}, parameters_);
  }

  std::vector<std::string> command_;
  Real seconds_ = 60, gigabytes_ = 0;
  bool shared_memory_ = true;
};

template <class Source>
bool add() {
  return Registry<EstimatorEntry>::instance().add(
      foreign_entry<Source>({Quantity::transmittance, Quantity::optical_depth, Quantity::free_path}));
}

[[maybe_unused]] const bool kRegistered = add<LibrarySource>() && add<ProcessSource>();

}  // namespace
}  // namespace nullmark
