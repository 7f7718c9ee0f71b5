/* Version, ABI number, names of statuses. */
#include "check.h"
#include <string.h>

int main(void)
{
  CHECK(ptzcal_abi_version() == PTZCAL_ABI_VERSION);
  CHECK(strchr(ptzcal_version(), '.') != NULL);
  CHECK(strcmp(ptzcal_status_name(PTZCAL_STATUS_OK), "PTZCAL_STATUS_OK") == 0);
  CHECK(strcmp(ptzcal_status_name(PTZCAL_STATUS_AMBIGUOUS), "PTZCAL_STATUS_AMBIGUOUS") == 0);
  CHECK(strcmp(ptzcal_status_name(-99), "PTZCAL_STATUS_UNKNOWN") == 0);
  CHECK(strcmp(ptzcal_status_name(INT32_MIN), "PTZCAL_STATUS_UNKNOWN") == 0);
  CHECK(strcmp(ptzcal_status_name(INT32_MAX), "PTZCAL_STATUS_UNKNOWN") == 0);
  return 0;
}
