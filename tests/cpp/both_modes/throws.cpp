// One half of a program whose other half has no exceptions: both ask the same of the same inline functions.
#include <check.h>
#include <ptzcal.hpp>

int fails_with_a_result();

int main()
{
  int status = 0;
  try {
    ptzcal::camera::load("/no/such/file.json");
  } catch (const ptzcal::error &error) {
    status = error.status();
  }
  CHECK(status == PTZCAL_STATUS_FILE_IO);
  CHECK(fails_with_a_result() == PTZCAL_STATUS_FILE_IO);
  return 0;
}
