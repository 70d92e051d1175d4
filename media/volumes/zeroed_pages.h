#pragma once

#include <cstdlib>
#include <new>
#include <utility>

namespace nullmark {

/// Gives a vector of numbers zeros that the system has not filled in yet: pages that nobody writes take no memory, so that a
/// large table costs what is put into it.
template <class T>
struct ZeroedPages {
  using value_type = T;

  ZeroedPages() = default;
  template <class U>
  ZeroedPages(const ZeroedPages<U>&) {}

  T* allocate(std::size_t n) {
    void* const pages = std::calloc(n, sizeof(T));
    if (!pages) throw std::bad_alloc();
    return static_cast<T*>(pages);
  }
  void deallocate(T* pages, std::size_t) { std::free(pages); }

  /// Nothing is left to do for a number that is zero.
  template <class U>
  void construct(U*) {}
  template <class U, class... Arguments>
  void construct(U* at, Arguments&&... arguments) {
    ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
  }

  bool operator==(const ZeroedPages&) const = default;
};

}  // namespace nullmark
