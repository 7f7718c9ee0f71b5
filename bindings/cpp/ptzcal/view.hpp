// Inputs: views of arrays, references that may be left out, strings.
#ifndef PTZCAL_VIEW_HPP
#define PTZCAL_VIEW_HPP

#include "mode.hpp"

#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <string>
#include <type_traits>

PTZCAL_BEGIN

// A contiguous array of somebody else, as std::span of C++20: of a vector, an array, (pointer, size),
// or, as an argument, numbers in braces. It must not outlive what it was made of.
template <class T>
class view {
 public:
  using element_type = T;
  using value_type = std::remove_cv_t<T>;

  constexpr view() noexcept = default;
  constexpr view(std::nullptr_t) noexcept {}
  constexpr view(T *data, std::size_t size) noexcept : data_(data), size_(size) {}

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Winit-list-lifetime"
#endif
  // The numbers live until the end of the call that they are an argument of.
  template <class U = T, class = std::enable_if_t<std::is_const_v<U>>>
  constexpr view(std::initializer_list<value_type> list) noexcept : data_(list.begin()), size_(list.size())
  {
  }
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

  template <class C, class E = std::remove_pointer_t<decltype(std::data(std::declval<C &>()))>,
            class = std::enable_if_t<std::is_convertible_v<E (*)[], T (*)[]>>>
  constexpr view(C &&container) noexcept : data_(std::data(container)), size_(std::size(container))
  {
  }

  constexpr T *data() const noexcept { return data_; }
  constexpr std::size_t size() const noexcept { return size_; }
  constexpr bool empty() const noexcept { return size_ == 0; }
  constexpr T *begin() const noexcept { return data_; }
  constexpr T *end() const noexcept { return data_ + size_; }
  constexpr T &operator[](std::size_t i) const noexcept { return data_[i]; }
  // `count` elements from `first` on, which must be there.
  constexpr view part(std::size_t first, std::size_t count) const noexcept { return view(data_ + first, count); }

 private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

// The numbers of an array of points: of std::vector<std::array<double, 3>>, of cv::Point2d, ...
template <class T = double, class C>
view<const T> numbers(const C &points) noexcept
{
  using P = std::remove_cv_t<std::remove_pointer_t<decltype(std::data(points))>>;
  static_assert(std::is_trivially_copyable_v<P> && std::is_standard_layout_v<P> && sizeof(P) % sizeof(T) == 0 &&
                    alignof(P) == alignof(T),
                "points are numbers and nothing else");
  return view<const T>(reinterpret_cast<const T *>(std::data(points)), std::size(points) * (sizeof(P) / sizeof(T)));
}

// An input that may be left out.
template <class T>
class optional_ref {
 public:
  constexpr optional_ref() noexcept = default;
  constexpr optional_ref(std::nullptr_t) noexcept {}
  constexpr optional_ref(const T &value) noexcept : value_(&value) {}
  constexpr optional_ref(const T *value) noexcept : value_(value) {}
  constexpr const T *get() const noexcept { return value_; }

 private:
  const T *value_ = nullptr;
};

// A string that ends with a NUL.
class c_string {
 public:
  constexpr c_string() noexcept = default;
  constexpr c_string(const char *text) noexcept : text_(text) {}
  c_string(const std::string &text) noexcept : text_(text.c_str()) {}
  constexpr const char *get() const noexcept { return text_; }

 private:
  const char *text_ = nullptr;
};

PTZCAL_END

#endif
