/* The interface of a tracker in a shared library: C11 or C++20, no dependency.
 *
 * A library exports nullmark_get_tracker.  A configuration names it: {"type": "library", "file": "./libmine.so", "name": "mine"}.
 * The harness owns rays, media, random streams, counting and the verdict; the tracker owns its loop.  harness/foreign/foreign.md is
 * the manual, harness/foreign/example/ratio.c an example.
 *
 * Structs begin with their size and only grow at the end, so a library and a program of different versions understand each other:
 * a member is there if `size` covers it.  Arrays are valid during the call that passes them.  A spectrum's channels are adjacent:
 * values[i * channels + c].  Lengths are world lengths, extinctions 1/length.
 */
#ifndef NULLMARK_TRACKER_H
#define NULLMARK_TRACKER_H

#include <stdint.h>

#define NULLMARK_ABI 1
#define NULLMARK_EXPORT __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* What every call returns.  STOP: a budget or a signal ended the cell; the tracker returns STOP at once, its results are dropped. */
enum { NULLMARK_OK = 0, NULLMARK_ERROR = 1, NULLMARK_STOP = 2 };

/* Quantities: bits of nullmark_tracker.quantities, one at a time elsewhere.  T = exp(-tau); tau; how a free flight ends. */
enum { NULLMARK_TRANSMITTANCE = 1, NULLMARK_OPTICAL_DEPTH = 2, NULLMARK_FREE_PATH = 4 };

/* What a tracker says of its mean: exact (no variance), unbiased, consistent (bias vanishes with a step), biased. */
enum { NULLMARK_EXACT = 0, NULLMARK_UNBIASED = 1, NULLMARK_CONSISTENT = 2, NULLMARK_BIASED = 3 };

/* Values of a sample where the majorant bounds the extinction: 0 or 1; [0, 1]; >= 0; any. */
enum { NULLMARK_BINARY = 0, NULLMARK_UNIT = 1, NULLMARK_NON_NEGATIVE = 2, NULLMARK_ANY_SIGN = 3 };

/* Random numbers: the harness's; the tracker's own, a function of (key, ray id, sample) alone; its own, never the same again. */
enum { NULLMARK_STREAMS_OF_HARNESS = 0, NULLMARK_STREAMS_OF_KEY = 1, NULLMARK_STREAMS_FREE = 2 };

/* How a free flight ends.  COLLIDED leaves the choice between absorption and scattering to the harness. */
enum { NULLMARK_ESCAPED = 0, NULLMARK_ABSORBED = 1, NULLMARK_SCATTERED = 2, NULLMARK_COLLIDED = 3 };

/* x(t) = origin + t direction for t in [begin, end].  Segments are contiguous and end at `end`; a ray that misses has none. */
typedef struct nullmark_ray {
  uint32_t size;
  int32_t channels, segments;
  int32_t crossing;             /* 0: a flight carries its exponential into the next segment; 1: it is drawn anew there */
  uint64_t id;                  /* of the ray, for streams of the tracker's own */
  double origin[3], direction[3], begin, end;
  const double* segment_end;    /* [segments] */
  const double* rate;           /* [segments] of tentative collisions, for the largest channel; may be below the extinction */
  const double* minimum;        /* [segments * channels] of the extinction; also average and maximum */
  const double* average;
  const double* maximum;
  const double* albedo;         /* [channels] scattering over extinction */
} nullmark_ray;

/* What the harness does for a tracker during `sample`.  `sample` holds indices from 0 to count - 1 of the call's samples. */
typedef struct nullmark_harness {
  uint32_t size;
  int32_t reserved;
  void* self;                   /* the first argument of every call */
  /* Extinction at distances along the ray: values[n * channels].  Each is counted as a lookup of its sample. */
  int32_t (*lookup)(void* self, int64_t n, const uint32_t* sample, const double* t, double* values);
  /* The same at world points[n * 3]. */
  int32_t (*lookup_at)(void* self, int64_t n, const uint32_t* sample, const double* points, double* values);
  /* Random numbers in [0, 1), from the stream of each sample; replay draws them again. */
  int32_t (*uniform)(void* self, int64_t n, const uint32_t* sample, double* u);
  /* Moves the flight of each sample to its next tentative collision: t[n], and the rate there; t = +inf: it left the ray. */
  int32_t (*next)(void* self, int64_t n, const uint32_t* sample, double* t, double* rate);
} nullmark_harness;

/* Where `sample` writes its results. */
typedef struct nullmark_result {
  uint32_t size;
  int32_t reserved;
  double* value;                /* [count * channels]; of a free path: null */
  double* distance;             /* [count] where the flight ended; free paths only, as event and weight */
  uint8_t* event;               /* [count] NULLMARK_ESCAPED ... */
  double* weight;               /* [count * channels] */
  uint64_t* lookups;            /* [count] with own_medium: what the tracker tells of its lookups */
} nullmark_result;

/* What a tracker says of itself. */
typedef struct nullmark_description {
  uint32_t size;
  int32_t guarantee, range;
  int32_t needs_bound;          /* 1: unbiased only where the rate bounds the extinction; 0: at any rate */
  int32_t own_medium;           /* 1: looks up a medium of its own and tells how often; 0: the harness answers and counts */
  int32_t streams;
  double order;                 /* consistent: |bias| ~ h^order; 0: not stated */
} nullmark_description;

typedef struct nullmark_tracker {
  uint32_t size;
  int32_t abi;                  /* NULLMARK_ABI of the header it was compiled with */
  const char *name, *summary, *source, *version;  /* version: of the tracker, for the record */
  uint32_t quantities;          /* bits of those it estimates */
  int32_t reserved;
  /* Once for every thread that uses the tracker.  `parameters` is a JSON object; an error's text is a line in `error`. */
  int32_t (*create)(const char* parameters, void** state, char* error, int64_t error_size);
  void (*destroy)(void* state);
  /* `out` comes with its size set, unbiased and of any sign, the rest 0. */
  int32_t (*describe)(void* state, int32_t quantity, int32_t channels, nullmark_description* out);
  /* May be null: exact mean, variance, lookups and variance of the lookups of a sample; NaN where not known. */
  int32_t (*theory)(void* state, const nullmark_ray* ray, int32_t quantity, int32_t channel, double out[4]);
  /* Draws samples first .. first + count - 1 of the ray.  `key` seeds streams of the tracker's own. */
  int32_t (*sample)(void* state, const nullmark_ray* ray, const nullmark_harness* harness, uint64_t key, uint64_t first,
                    int64_t count, int32_t quantity, nullmark_result* result, char* error, int64_t error_size);
} nullmark_tracker;

/* The library's trackers, from index 0; null past the last, and where it knows no interface of version `harness_abi`. */
NULLMARK_EXPORT const nullmark_tracker* nullmark_get_tracker(int32_t harness_abi, int32_t index);

#ifdef __cplusplus
}
#endif

#endif
