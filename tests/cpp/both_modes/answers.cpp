#define PTZCAL_NO_EXCEPTIONS
#include <ptzcal.hpp>

int fails_with_a_result()
{
  return ptzcal::camera::load("/no/such/file.json").status();
}
