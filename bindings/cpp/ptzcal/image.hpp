// Views of pixels.
#ifndef PTZCAL_IMAGE_HPP
#define PTZCAL_IMAGE_HPP

#include "api.hpp"

#include <cstddef>
#include <cstdint>

PTZCAL_BEGIN

// A packed image (gray8, rgb24, bgr24, rgba32, bgra32, yuyv) in the caller's memory: `pixels` is its top
// row's first byte, `stride` the bytes from a row to the one below: 0 for rows without gaps, negative
// for an image stored bottom-up.
inline image packed_image(pixel_format format, const void *pixels, std::uint32_t width, std::uint32_t height,
                          std::ptrdiff_t stride = 0) noexcept
{
  const std::ptrdiff_t bytes = format == pixel_format::gray8 ? 1
                               : format == pixel_format::yuyv ? 2
                               : format == pixel_format::rgb24 || format == pixel_format::bgr24 ? 3 : 4;
  const std::ptrdiff_t row = bytes * static_cast<std::ptrdiff_t>(width);
  image view;
  view.format = format;
  view.width = width;
  view.height = height;
  view.plane[0] = pixels;
  view.stride[0] = stride == 0 ? row : stride;
  const std::ptrdiff_t step = view.stride[0] < 0 ? -view.stride[0] : view.stride[0];
  view.size[0] = height == 0 ? 0 : static_cast<std::size_t>(step * (static_cast<std::ptrdiff_t>(height) - 1) + row);
  return view;
}

PTZCAL_END

#endif
