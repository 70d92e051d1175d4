/* Ratio tracking through nullmark_tracker.h, with the harness's flights and streams [Novak, Selle, Jarosz 2014, Alg. 1].
 *
 *   cc -O2 -std=c11 -shared -fPIC -I harness/foreign -o libratio.so harness/foreign/example/ratio.c
 */
#include "nullmark_tracker.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Memory of one thread. */
typedef struct {
  double *t, *rate, *extinction;
  uint32_t* alive;
  int64_t room;
  int32_t channels;
} ratio_state;

static void ratio_destroy(void* self) {
  ratio_state* state = self;
  free(state->t);
  free(state->rate);
  free(state->extinction);
  free(state->alive);
  free(state);
}

static int32_t ratio_create(const char* parameters, void** self, char* error, int64_t error_size) {
  if (strcmp(parameters, "{}") != 0) {
    strncpy(error, "it takes none", (size_t)error_size);
    return NULLMARK_ERROR;
  }
  *self = calloc(1, sizeof(ratio_state));
  return *self ? NULLMARK_OK : NULLMARK_ERROR;
}

static int reserve(ratio_state* state, int64_t count, int32_t channels) {
  if (count <= state->room && channels <= state->channels) return 1;
  if (count < state->room) count = state->room;
  if (channels < state->channels) channels = state->channels;
  const size_t n = (size_t)count;
  state->t = realloc(state->t, n * sizeof(double));
  state->rate = realloc(state->rate, n * sizeof(double));
  state->extinction = realloc(state->extinction, n * (size_t)channels * sizeof(double));
  state->alive = realloc(state->alive, n * sizeof(uint32_t));
  state->room = count;
  state->channels = channels;
  return state->t && state->rate && state->extinction && state->alive;
}

static int32_t ratio_describe(void* self, int32_t quantity, int32_t channels, nullmark_description* out) {
  (void)self, (void)quantity, (void)channels;
  out->guarantee = NULLMARK_UNBIASED;
  out->range = NULLMARK_UNIT;
  out->streams = NULLMARK_STREAMS_OF_HARNESS;
  return NULLMARK_OK;
}

static int32_t ratio_sample(void* self, const nullmark_ray* ray, const nullmark_harness* harness, uint64_t key, uint64_t first,
                            int64_t count, int32_t quantity, nullmark_result* result, char* error, int64_t error_size) {
  (void)key, (void)first, (void)quantity, (void)error, (void)error_size;
  ratio_state* state = self;
  const int64_t channels = ray->channels;
  if (!reserve(state, count, ray->channels)) return NULLMARK_ERROR;
  for (int64_t i = 0; i < count * channels; ++i) result->value[i] = 1;
  for (int64_t k = 0; k < count; ++k) state->alive[k] = (uint32_t)k;
  for (int64_t n = count; n > 0;) {
    int32_t code = harness->next(harness->self, n, state->alive, state->t, state->rate);
    if (code != NULLMARK_OK) return code;
    int64_t kept = 0;
    for (int64_t i = 0; i < n; ++i) {
      if (isinf(state->t[i])) continue;
      state->alive[kept] = state->alive[i];
      state->t[kept] = state->t[i];
      state->rate[kept++] = state->rate[i];
    }
    n = kept;
    code = harness->lookup(harness->self, n, state->alive, state->t, state->extinction);
    if (code != NULLMARK_OK) return code;
    for (int64_t i = 0; i < n; ++i)
      for (int64_t c = 0; c < channels; ++c)
        result->value[state->alive[i] * channels + c] *=
            (state->rate[i] - state->extinction[i * channels + c]) * (1 / state->rate[i]);
  }
  return NULLMARK_OK;
}

static const nullmark_tracker ratio = {.size = sizeof(nullmark_tracker),
                                       .abi = NULLMARK_ABI,
                                       .name = "ratio",
                                       .summary = "ratio tracking in C",
                                       .source = "Novak, Selle, Jarosz 2014, Alg. 1",
                                       .version = "1",
                                       .quantities = NULLMARK_TRANSMITTANCE,
                                       .create = ratio_create,
                                       .destroy = ratio_destroy,
                                       .describe = ratio_describe,
                                       .sample = ratio_sample};

const nullmark_tracker* nullmark_get_tracker(int32_t harness_abi, int32_t index) {
  return harness_abi >= NULLMARK_ABI && index == 0 ? &ratio : NULL;
}
