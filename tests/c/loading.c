/* dlopen and dlclose, again and again, and two copies of the library in one process. */
#include "check.h"
#include <dlfcn.h>
#include <string.h>

/* ISO C knows no conversion from an object pointer to a function pointer; POSIX does. */
#define LOOK_UP(function, library, name)                    \
  do {                                                      \
    void *address = dlsym(library, name);                   \
    CHECK(address != NULL && sizeof address == sizeof function); \
    memcpy(&function, &address, sizeof function);           \
  } while (0)

typedef struct copy {
  void *library;
  uint32_t (*abi_version)(void);
  ptzcal_status (*cancel_new)(ptzcal_cancel **, ptzcal_error **);
  ptzcal_status (*cancel_request)(const ptzcal_cancel *);
  int32_t (*cancel_is_requested)(const ptzcal_cancel *);
  void (*cancel_free)(ptzcal_cancel *);
  const char *(*error_message)(const ptzcal_error *);
  void (*error_free)(ptzcal_error *);
} copy;

static copy load(const char *path)
{
  copy c;
  memset(&c, 0, sizeof c);
  c.library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!c.library) fprintf(stderr, "%s\n", dlerror());
  CHECK(c.library != NULL);
  LOOK_UP(c.abi_version, c.library, "ptzcal_abi_version");
  LOOK_UP(c.cancel_new, c.library, "ptzcal_cancel_new");
  LOOK_UP(c.cancel_request, c.library, "ptzcal_cancel_request");
  LOOK_UP(c.cancel_is_requested, c.library, "ptzcal_cancel_is_requested");
  LOOK_UP(c.cancel_free, c.library, "ptzcal_cancel_free");
  LOOK_UP(c.error_message, c.library, "ptzcal_error_message");
  LOOK_UP(c.error_free, c.library, "ptzcal_error_free");
  CHECK(c.abi_version() == PTZCAL_ABI_VERSION);
  return c;
}

static void use(const copy *c)
{
  ptzcal_error *error = NULL;
  ptzcal_cancel *token = NULL;
  CHECK_OK(c->cancel_new(&token, &error));
  CHECK(!c->cancel_is_requested(token));
  CHECK_OK(c->cancel_request(token));
  CHECK(c->cancel_is_requested(token));
  c->cancel_free(token);
  CHECK_STATUS(PTZCAL_STATUS_NULL_POINTER, c->cancel_new(NULL, &error));
  CHECK(strcmp(c->error_message(error), "token is NULL") == 0);
  c->error_free(error);
}

/* The same bytes under another name are another library to the loader. */
static void duplicate(const char *from, const char *to)
{
  char buffer[1 << 16];
  size_t n;
  FILE *in = fopen(from, "rb"), *out = fopen(to, "wb");
  CHECK(in && out);
  while ((n = fread(buffer, 1, sizeof buffer, in)) > 0) CHECK(fwrite(buffer, 1, n, out) == n);
  CHECK(fclose(in) == 0 && fclose(out) == 0);
}

int main(int count, char **words)
{
  char path[4096];
  copy first, second;
  int i;
  CHECK(count == 3);
  for (i = 0; i < 50; i++) {
    first = load(words[1]);
    use(&first);
    CHECK(dlclose(first.library) == 0);
  }
  CHECK(snprintf(path, sizeof path, "%s/libtwin.so", words[2]) < (int)sizeof path);
  duplicate(words[1], path);
  first = load(words[1]);
  second = load(path);
  CHECK(first.cancel_new != second.cancel_new);
  use(&first);
  use(&second);
  CHECK(dlclose(first.library) == 0);
  use(&second);
  CHECK(dlclose(second.library) == 0);
  /* It stays in memory (-z nodelete): code that is still running in it is never pulled away. */
  CHECK(second.abi_version() == PTZCAL_ABI_VERSION);
  return 0;
}
