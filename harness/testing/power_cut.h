#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace nullmark {

/// What a program did to the files of one folder, and what a power cut may leave of it.  Before a sync of a file, any of its
/// writes and truncations may be lost, in any order, or half done; before a sync of the folder, any of its names.  This is what
/// POSIX promises; file systems promise more.

/// One step, as faulty_disk.cpp tells it, a line each:
///   create NAME | write NAME PLACE BYTES | truncate NAME SIZE | sync NAME | rename FROM TO | unlink NAME | sync_folder
struct DiskStep {
  std::string what, name, to, bytes;
  std::size_t place = 0;  ///< of a write; the size of a truncation

  bool of_folder() const { return what == "create" || what == "rename" || what == "unlink"; }
  bool of_file() const { return what == "write" || what == "truncate"; }
};

/// Names that the program finds there, and their bytes.
using DiskFiles = std::map<std::string, std::string>;

/// The steps on files whose name begins with `prefix`.  A file that was not there is created before its first step.
inline std::vector<DiskStep> read_disk_steps(const std::filesystem::path& log, const std::string& prefix,
                                             const DiskFiles& before) {
  std::set<std::string> known;
  for (const auto& [name, bytes] : before) known.insert(name);
  std::vector<DiskStep> steps;
  std::ifstream in(log);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    DiskStep step;
    std::string digits;
    words >> step.what >> step.name;
    if (step.what == "write") words >> step.place >> digits;
    if (step.what == "truncate") words >> step.place;
    if (step.what == "rename") words >> step.to;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
      step.bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
    if (step.what != "sync_folder" && step.name.rfind(prefix, 0) != 0) continue;
    if ((step.of_file() || step.what == "sync") && known.insert(step.name).second)
      steps.push_back({.what = "create", .name = step.name, .to = "", .bytes = ""});
    if (step.what == "rename" || step.what == "unlink") known.erase(step.name);
    if (step.what == "rename") known.insert(step.to);
    steps.push_back(step);
  }
  return steps;
}

/// How much of a step reaches the disk.
enum class Kept {
  none,
  all,
  size,         ///< of a write: its bytes are zeros
  first_half,   ///< of a write
  second_half,  ///< of a write; the first is zeros
};

/// The files after the first steps, of which kept[i] of step i reached the disk.
inline DiskFiles files_after(const DiskFiles& before, const std::vector<DiskStep>& steps, const std::vector<Kept>& kept) {
  std::vector<std::string> contents;
  std::map<std::string, std::size_t> live, durable;  // content by name: as the program sees it, and on the disk
  for (const auto& [name, bytes] : before) {
    durable[name] = live[name] = contents.size();
    contents.push_back(bytes);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const DiskStep& step = steps[i];
    const bool whole = kept[i] == Kept::all;
    if (step.what == "create") {
      live[step.name] = contents.size();
      contents.emplace_back();
      if (whole) durable[step.name] = live[step.name];
    } else if (step.what == "rename") {
      live[step.to] = live.at(step.name);
      live.erase(step.name);
      if (whole) {
        durable[step.to] = live[step.to];
        durable.erase(step.name);
      }
    } else if (step.what == "unlink") {
      live.erase(step.name);
      if (whole) durable.erase(step.name);
    } else if (step.what == "truncate") {
      if (whole) contents[live.at(step.name)].resize(step.place);
    } else if (step.what == "write" && kept[i] != Kept::none) {
      std::string& content = contents[live.at(step.name)];
      std::string bytes = step.bytes;
      const std::size_t half = bytes.size() / 2;
      if (kept[i] == Kept::first_half) bytes.resize(half);
      if (kept[i] == Kept::size) bytes.assign(bytes.size(), '\0');
      if (kept[i] == Kept::second_half) bytes.replace(0, half, half, '\0');
      if (content.size() < step.place + bytes.size()) content.resize(step.place + bytes.size());
      content.replace(step.place, bytes.size(), bytes);
    }
  }
  DiskFiles files;
  for (const auto& [name, content] : durable) files[name] = contents[content];
  return files;
}

/// Of the first `count` steps, those that no sync has put on the disk.
inline std::vector<std::size_t> unsynced_steps(const std::vector<DiskStep>& steps, std::size_t count) {
  std::vector<std::size_t> pending;
  for (std::size_t i = 0; i < count; ++i) {
    std::string name = steps[i].name;
    bool synced = !steps[i].of_folder() && !steps[i].of_file();
    for (std::size_t j = i + 1; j < count && !synced; ++j) {
      if (steps[i].of_folder())
        synced = steps[j].what == "sync_folder";
      else if (steps[j].what == "rename" && steps[j].name == name)
        name = steps[j].to;
      else
        synced = steps[j].what == "sync" && steps[j].name == name;
    }
    if (!synced) pending.push_back(i);
  }
  return pending;
}

/// What a power cut after the first `count` steps may leave: all that is unsynced, none of it, all but one, one alone, each write
/// torn, and choices at random.
inline std::set<DiskFiles> states_after_cut(const DiskFiles& before, const std::vector<DiskStep>& steps, std::size_t count) {
  constexpr int kChoices = 16;
  const std::vector<std::size_t> pending = unsynced_steps(steps, count);
  std::set<DiskFiles> states;
  const auto add = [&](const auto& kept_of) {
    std::vector<Kept> kept(count, Kept::all);
    for (const std::size_t i : pending) kept[i] = kept_of(i);
    states.insert(files_after(before, steps, kept));
  };
  for (const Kept rest : {Kept::none, Kept::all}) {
    add([&](std::size_t) { return rest; });
    for (const std::size_t one : pending)
      for (const Kept kept : {Kept::none, Kept::all, Kept::size, Kept::first_half, Kept::second_half})
        if (steps[one].what == "write" || kept == Kept::none || kept == Kept::all)
          add([&](std::size_t i) { return i == one ? kept : rest; });
  }
  std::mt19937 random(static_cast<unsigned>(count));
  for (int choice = 0; choice < kChoices; ++choice)
    add([&](std::size_t i) {
      const int kept = std::uniform_int_distribution<int>(0, steps[i].what == "write" ? 4 : 1)(random);
      return static_cast<Kept>(kept);
    });
  return states;
}

}  // namespace nullmark
