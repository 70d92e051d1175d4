#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace nullmark {

/// Writes values as bytes, one after another.  A structure is written by `fields(archive, structure)`, which names its members.
class ByteWriter {
 public:
  template <class... T>
  void operator()(T&... values) {
    (write(values), ...);
  }
  std::string take() { return std::move(bytes_); }

 private:
  template <class T>
  void write(T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    else
      fields(*this, value);
  }
  void write(std::string& text) {
    count(text.size());
    bytes_ += text;
  }
  template <class T>
  void write(std::vector<T>& list) {
    count(list.size());
    for (T& value : list) write(value);
  }
  template <class T, std::size_t n>
  void write(std::array<T, n>& list) {
    for (T& value : list) write(value);
  }
  template <class K, class T>
  void write(std::map<K, T>& map) {
    count(map.size());
    for (auto& [key, value] : map) {
      K copy = key;
      write(copy);
      write(value);
    }
  }
  template <class T>
  void write(std::optional<T>& value) {
    bool any = value.has_value();
    write(any);
    if (any) write(*value);
  }
  void count(std::uint64_t size) { write(size); }

  std::string bytes_;
};

/// Reads what ByteWriter wrote.  `good` is false once bytes are missing.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class... T>
  void operator()(T&... values) {
    (read(values), ...);
  }
  /// Whether all bytes were read, and none was missing.
  bool complete() const { return good_ && bytes_.empty(); }

 private:
  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      unsigned char byte = 0;
      read(byte);
      good_ = good_ && byte <= 1;
      value = byte == 1;
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      good_ = good_ && bytes_.size() >= sizeof value;
      if (!good_) return;
      std::memcpy(&value, bytes_.data(), sizeof value);
      bytes_.remove_prefix(sizeof value);
    } else {
      fields(*this, value);
    }
  }
  void read(std::string& text) {
    const std::size_t size = count();
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
  }
  template <class T>
  void read(std::vector<T>& list) {
    list.clear();
    for (std::size_t left = count(); left > 0 && good_; --left) read(list.emplace_back());
  }
  template <class T, std::size_t n>
  void read(std::array<T, n>& list) {
    for (T& value : list) read(value);
  }
  template <class K, class T>
  void read(std::map<K, T>& map) {
    map.clear();
    for (std::size_t left = count(); left > 0 && good_; --left) {
      K key{};
      read(key);
      read(map[key]);
    }
  }
  template <class T>
  void read(std::optional<T>& value) {
    bool any = false;
    read(any);
    value.reset();
    if (any && good_) read(value.emplace());
  }
  /// A number of elements that the bytes left can hold.
  std::size_t count() {
    std::uint64_t size = 0;
    read(size);
    good_ = good_ && size <= bytes_.size();
    return good_ ? static_cast<std::size_t>(size) : 0;
  }

  std::string_view bytes_;
  bool good_ = true;
};

}  // namespace nullmark
