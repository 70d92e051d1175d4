#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "harness/io/field_types.h"

/// A struct's keys in JSON are said once.  A function
///
///   template <class Visit>
///   void visit_fields(Visit& visit, Struct& value)
///
/// calls one of the following for each member, in the order of the file:
///
///   visit.required(key, member, text)         always written; a file without it is refused
///   visit.lenient(key, member, text)          always written; where a file lacks it, the member keeps its default
///   visit.sparse(key, member, text)           written where it differs from nothing: from 0, from an empty list, from no value
///   visit.when(key, present, member, text)    written where the flag `present` is set; a file that has the key sets the flag
///   visit.part(key, fields)                   an object whose keys `fields(visit)` visits
///   visit.optional_part(key, member, fields)  the same of a std::optional, with `fields(visit, value)`; null where it is empty
///   visit.list(key, member, fields)           a list of objects, with `fields(visit, element)`; a file may lack it
///   visit.derived(key, get, text)             computed by `get()` when written, and not read back
///
/// `FieldWriter` makes JSON of it, `FieldReader` reads JSON back, `FieldSchema` describes it as JSON Schema, `FieldKeys` lists
/// the keys.  What a member may be: field_types.h.
namespace nullmark {

enum class Presence { required, lenient, sparse };

/// The calls above, as `field(presence, key, field, text)` of a visitor.
template <class Self>
class FieldVisitor {
 public:
  static constexpr bool kReads = false, kDescribes = false;

  void required(const char* key, auto&& member, const char* text = "") {
    self().field(Presence::required, key, as_field(member), text);
  }
  void lenient(const char* key, auto&& member, const char* text = "") {
    self().field(Presence::lenient, key, as_field(member), text);
  }
  void sparse(const char* key, auto&& member, const char* text = "") {
    self().field(Presence::sparse, key, as_field(member), text);
  }

 private:
  Self& self() { return static_cast<Self&>(*this); }
};

/// Makes the JSON of a struct.
class FieldWriter : public FieldVisitor<FieldWriter> {
 public:
  template <class Field>
  void field(Presence presence, const char* key, const Field& field, const char*) {
    if constexpr (requires { field.empty(); })
      if (presence == Presence::sparse && field.empty()) return;
    json_[key] = field.json();
  }
  void when(const char* key, bool present, auto&& member, const char* = "") {
    if (present) required(key, member);
  }
  void part(const char* key, auto&& fields) { json_[key] = written(fields); }
  void optional_part(const char* key, auto& member, auto&& fields) {
    json_[key] = member ? written([&](FieldWriter& visit) { fields(visit, *member); }) : Json(nullptr);
  }
  void list(const char* key, auto& member, auto&& fields) {
    Json list = Json::array();
    for (auto& element : member) list.push_back(written([&](FieldWriter& visit) { fields(visit, element); }));
    json_[key] = std::move(list);
  }
  void derived(const char* key, auto&& get, const char* = "") {
    auto value = get();
    required(key, value);
  }

  Json take() { return std::move(json_); }

 private:
  static Json written(auto&& fields) {
    FieldWriter visit;
    fields(visit);
    return visit.take();
  }

  Json json_ = Json::object();
};

/// Reads a struct's members back.  Throws InputError.
class FieldReader : public FieldVisitor<FieldReader> {
 public:
  static constexpr bool kReads = true;

  explicit FieldReader(const JsonNode& node) : node_(node) { node_.expect_object(); }

  const JsonNode& node() const { return node_; }

  void field(Presence presence, const char* key, const auto& field, const char*) {
    if (presence == Presence::required || node_.has(key)) field.read(node_[key]);
  }
  void when(const char* key, bool& present, auto&& member, const char* = "") {
    present = node_.has(key);
    lenient(key, member);
  }
  void part(const char* key, auto&& fields) {
    FieldReader inner(node_[key]);
    fields(inner);
  }
  void optional_part(const char* key, auto& member, auto&& fields) {
    if (!node_.has(key) || node_[key].json().is_null()) return;
    FieldReader inner(node_[key]);
    fields(inner, member.emplace());
  }
  void list(const char* key, auto& member, auto&& fields) {
    if (!node_.has(key)) return;
    for (const JsonNode& element : node_[key].elements()) {
      FieldReader inner(element);
      fields(inner, member.emplace_back());
    }
  }
  void derived(const char*, auto&&, const char* = "") {}

 private:
  JsonNode node_;
};

/// Describes a struct; a default is what the struct itself begins with.
class FieldSchema : public FieldVisitor<FieldSchema> {
 public:
  static constexpr bool kDescribes = true;

  /// `closed`: keys that the struct does not have are refused, and defaults are told, as in configurations.
  explicit FieldSchema(bool closed) : closed_(closed) {}

  void field(Presence presence, const char* key, const auto& field, const char* text) {
    Json schema = field.schema();
    if (closed_ && presence == Presence::lenient) schema["default"] = field.json();
    properties_[key] = described(std::move(schema), text);
    if (presence == Presence::required) required_.push_back(key);
  }
  void when(const char* key, bool, auto&& member, const char* text = "") { sparse(key, member, text); }
  void part(const char* key, auto&& fields) {
    properties_[key] = schema_of(fields);
    required_.push_back(key);
  }
  template <class T>
  void optional_part(const char* key, T&, auto&& fields) {
    typename T::value_type value{};
    properties_[key] = schema_of([&](FieldSchema& visit) { fields(visit, value); });
    properties_[key]["type"] = {"object", "null"};
  }
  template <class T>
  void list(const char* key, T&, auto&& fields) {
    typename T::value_type value{};
    properties_[key] = list_schema(schema_of([&](FieldSchema& visit) { fields(visit, value); }));
  }
  template <class Get>
  void derived(const char* key, Get&&, const char* text = "") {
    std::invoke_result_t<Get> value{};
    sparse(key, value, text);
  }

  Json take() {
    Json json = {{"type", "object"}, {"properties", std::move(properties_)}};
    if (!required_.empty()) json["required"] = required_;
    if (closed_) {
      json["patternProperties"] = {{"^x-", Json::object()}};
      json["additionalProperties"] = false;
    }
    return json;
  }

 private:
  Json schema_of(auto&& fields) const {
    FieldSchema visit(closed_);
    fields(visit);
    return visit.take();
  }

  bool closed_;
  Json properties_ = Json::object();
  std::vector<std::string> required_;
};

/// The keys of a struct.
class FieldKeys : public FieldVisitor<FieldKeys> {
 public:
  void field(Presence, const char* key, const auto&, const char*) { keys.push_back(key); }

  std::vector<std::string> keys;
};

template <class Struct>
Json fields_json(const Struct& value) {
  FieldWriter visit;
  visit_fields(visit, const_cast<Struct&>(value));  // a writer changes nothing
  return visit.take();
}

template <class Struct>
void read_fields(const JsonNode& node, Struct& value) {
  FieldReader visit(node);
  visit_fields(visit, value);
}

/// A part of a configuration: every key may be misspelt, and none is ignored.
template <class Struct>
Struct read_closed(const JsonNode& node, Struct value = {}) {
  FieldKeys visit;
  visit_fields(visit, value);
  node.expect_keys(visit.keys);
  read_fields(node, value);
  return value;
}

template <class Struct>
Json fields_schema(bool closed, Struct value = {}) {
  FieldSchema visit(closed);
  visit_fields(visit, value);
  return visit.take();
}

template <class Struct>
Json closed_schema(Struct value = {}) {
  return fields_schema(true, std::move(value));
}

}  // namespace nullmark
