#include <fmt/format.h>

#include <array>
#include <cmath>
#include <span>

#include "harness/io/text.h"
#include "harness/model/names.h"
#include "harness/run/replay.h"

namespace nullmark {
namespace {

Json number_or_name(Real x) { return std::isfinite(x) ? Json(x) : Json(fmt::to_string(x)); }

template <class List>
Json numbers(const List& list) {
  Json result = Json::array();
  for (const Real x : list) result.push_back(number_or_name(x));
  return result;
}

/// Entries of step i in a list of [step * channels + c]; none where the list holds none.
std::span<const Real> of_step(const std::vector<Real>& list, std::size_t i, int channels) {
  const auto n = static_cast<std::size_t>(channels);
  return list.size() < (i + 1) * n ? std::span<const Real>() : std::span(list).subspan(i * n, n);
}

std::string words(std::span<const Real> list) { return list.empty() ? "-" : fmt::format("{:.9g}", fmt::join(list, " ")); }

std::string point(const Vec3& p) { return fmt::format("({:.9g}, {:.9g}, {:.9g})", p.x(), p.y(), p.z()); }

const char* event_name(EventKind kind) {
  switch (kind) {
    case EventKind::escape:
      return "escapes";
    case EventKind::surface:
      return "meets a surface";
    case EventKind::collision:
      return "collides";
    case EventKind::absorb:
      return "is absorbed";
    case EventKind::scatter:
      break;
  }
  return "scatters";
}

/// How a sampler's flight ended; empty of other quantities.
std::string end_text(const Replay& replay) {
  if (replay.quantity != Quantity::free_path) return "";
  return fmt::format("{} at {:.9g}", event_name(replay.walk.end), replay.walk.distance);
}

std::string steps_text(const Replay& replay) {
  const Recording::Walk& walk = replay.walk;
  const std::span<const Real> draws(replay.draws);
  std::vector<std::vector<std::string>> lines = {
      {"step", "random numbers", "distance", "bound's depth", "bound", "extinction", "transmittance"}};
  std::uint64_t drawn = 0;
  for (std::size_t i = 0; i < walk.steps.size(); ++i) {
    const Recording::Step& step = walk.steps[i];
    lines.push_back({fmt::to_string(i + 1), words(draws.subspan(drawn, step.draws - drawn)), fmt::format("{:.9g}", step.position),
                     fmt::format("{:.9g}", step.depth), step.rate > 0 ? fmt::format("{:.9g}", step.rate) : "-",
                     words(of_step(walk.extinction, i, replay.channels)),
                     words(of_step(replay.transmittance, i, replay.channels))});
    drawn = step.draws;
  }
  lines.push_back({"end", words(draws.subspan(drawn)), "", "", "", "", end_text(replay)});
  return aligned(lines, 2);
}

}  // namespace

Json replay_json(const Replay& replay) {
  const auto vector = [](const Vec3& v) { return numbers(std::array{v.x(), v.y(), v.z()}); };
  Json json = {{"cell", replay.cell},
               {"ray", replay.ray},
               {"sample", replay.sample},
               {"quantity", to_string(replay.quantity)},
               {"precision", to_string(replay.precision)},
               {"origin", vector(replay.world.origin)},
               {"direction", vector(replay.world.direction)},
               {"begin", number_or_name(replay.world.begin)},
               {"end", number_or_name(replay.world.end)},
               {"lookups", replay.lookups},
               {"draws", numbers(replay.draws)},
               {"values", Json::array()},
               {"steps", Json::array()}};
  for (std::size_t o = 0; o < replay.values.size(); ++o)
    json["values"].push_back({{"output", replay.outputs[o]},
                              {"value", number_or_name(replay.values[o])},
                              {"target", replay.targets[o] ? number_or_name(*replay.targets[o]) : Json()}});
  const Recording::Walk& walk = replay.walk;
  for (std::size_t i = 0; i < walk.steps.size(); ++i) {
    const Recording::Step& step = walk.steps[i];
    Json entry = {{"position", number_or_name(step.position)},
                  {"point", vector(replay.world.at(step.position))},
                  {"majorant_depth", number_or_name(step.depth)},
                  {"majorant", step.rate > 0 ? number_or_name(step.rate) : Json()},
                  {"extinction", numbers(of_step(walk.extinction, i, replay.channels))},
                  {"draws", step.draws}};
    if (!replay.transmittance.empty()) entry["transmittance"] = numbers(of_step(replay.transmittance, i, replay.channels));
    json["steps"].push_back(std::move(entry));
  }
  if (const std::string end = end_text(replay); !end.empty()) json["flight"] = end;
  return json;
}

std::string replay_text(const Replay& replay) {
  std::string text;
  for (std::size_t o = 0; o < replay.values.size(); ++o)
    text += fmt::format("{} {:.9g}{}\n", replay.outputs[o], replay.values[o],
                        replay.targets[o] ? fmt::format(", expected {:.9g}", *replay.targets[o]) : "");
  text +=
      fmt::format("{}, ray {}, sample {}\nfrom {} along {}, distances {:.9g} to {:.9g}\n", replay.cell, replay.ray, replay.sample,
                  point(replay.world.origin), point(replay.world.direction), replay.world.begin, replay.world.end);
  text += fmt::format("{} lookup{}, {} random number{}\n\n", replay.lookups, replay.lookups == 1 ? "" : "s", replay.draws.size(),
                      replay.draws.size() == 1 ? "" : "s");
  if (replay.walk.steps.empty() && replay.lookups > 0) return text + fmt::format("random numbers {}\n", words(replay.draws));
  return text + steps_text(replay);
}

}  // namespace nullmark
