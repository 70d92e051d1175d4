/* A tracker that only looks up: 8 lookups of each sample, 512 in a call.  What it costs beyond the medium is the seam's. */

#include "harness/foreign/nullmark_tracker.h"

enum { TOGETHER = 512, EACH = 8, MOST_CHANNELS = 16 };

static int32_t touch_create(const char* parameters, void** state, char* error, int64_t error_size) {
  (void)parameters, (void)error, (void)error_size;
  *state = 0;
  return NULLMARK_OK;
}

static void touch_destroy(void* state) { (void)state; }

static int32_t touch_describe(void* state, int32_t quantity, int32_t channels, nullmark_description* out) {
  (void)state, (void)quantity, (void)channels;
  out->guarantee = NULLMARK_BIASED;
  return NULLMARK_OK;
}

static int32_t touch_sample(void* state, const nullmark_ray* ray, const nullmark_harness* harness, uint64_t key, uint64_t first,
                            int64_t count, int32_t quantity, nullmark_result* result, char* error, int64_t error_size) {
  (void)state, (void)key, (void)first, (void)quantity, (void)error, (void)error_size;
  static _Thread_local double t[TOGETHER], values[TOGETHER * MOST_CHANNELS];
  static _Thread_local uint32_t sample[TOGETHER];
  for (int64_t i = 0; i < count * ray->channels; ++i) result->value[i] = 0;
  for (int64_t from = 0; from < count; from += TOGETHER) {
    const int64_t n = count - from < TOGETHER ? count - from : TOGETHER;
    for (int64_t i = 0; i < n; ++i) {
      sample[i] = (uint32_t)(from + i);
      t[i] = ray->begin + (ray->end - ray->begin) * (double)i / TOGETHER;
    }
    for (int j = 0; j < EACH; ++j) {
      const int32_t code = harness->lookup(harness->self, n, sample, t, values);
      if (code != NULLMARK_OK) return code;
    }
  }
  return NULLMARK_OK;
}

static const nullmark_tracker touch = {.size = sizeof(nullmark_tracker),
                                       .abi = NULLMARK_ABI,
                                       .name = "touch",
                                       .quantities = NULLMARK_TRANSMITTANCE,
                                       .create = touch_create,
                                       .destroy = touch_destroy,
                                       .describe = touch_describe,
                                       .sample = touch_sample};

const nullmark_tracker* nullmark_get_tracker(int32_t harness_abi, int32_t index) {
  return harness_abi >= NULLMARK_ABI && index == 0 ? &touch : 0;
}
