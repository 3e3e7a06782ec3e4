/*
@heading@
 *
 *     u      = F xh + alpha + Q beta       @p@_command: within its limits; apply it
 *     beta   = y - C xh - D u              @p@_observe: with the u that was really applied; log the row
 *     xh[+]  = A xh + B u - L beta
 *
 * The whole loop of a firmware: guard, ramps, and a Q that is exchanged while the loop runs. It does what ExcitedLoop
 * of the Rust crate youla-rt does, bit by bit where the compiler does not contract products and sums
 * (-ffp-contract=off). docs/firmware.md explains phases, causes and the exchange of Q.
 *
 *     static @p@_loop s;
 *     @p@_init(&s, &limits, 500);                     ramps of 500 samples
 *     each sample:
 *         @p@_command(&s, wanted, u);                 wanted: the excitation at its full size; limit and apply u
 *         @p@_observe(&s, y, u, &row);
 *
 * C99 without any dependency. Double precision, or single with -DYOULA_REAL=float; largest order of Q with
 * -DYOULA_Q_ORDER=20.
 */
@real@
#include <limits.h>
#include <stdint.h>
#include <string.h>

#ifndef YOULA_Q_ORDER
#define YOULA_Q_ORDER 20
#endif
#if YOULA_Q_ORDER < 1
#error "YOULA_Q_ORDER is the largest order of Q; set it to 1 or more"
#endif
/* With these flags the compiler takes every number for finite, and the checks of the guard drop out. */
#if defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__ > 0
#error "the guard needs numbers that are not finite; compile without -ffast-math and -ffinite-math-only"
#endif

enum { @p@_states = @n@, @p@_inputs = @m@, @p@_outputs = @q@, @p@_q_states = YOULA_Q_ORDER };
/* Coefficients of Q: A, B, C by rows. */
enum { @p@_q_count = YOULA_Q_ORDER * (YOULA_Q_ORDER + @p@_outputs + @p@_inputs) };
enum { @p@_idle, @p@_armed, @p@_exciting, @p@_tripped };
/* Why the guard ended an excitation. */
enum {
    @p@_sensor_not_finite = 1, @p@_sensor_stuck, @p@_output_limit, @p@_residual_limit, @p@_input_limit, @p@_host_silent,
    @p@_time_over, @p@_excitation_not_finite, @p@_q_refused, @p@_state_not_finite
};
/* What a request returns: 0, or why it was refused. */
enum {
    @p@_done, @p@_limits_not_positive, @p@_not_armed, @p@_has_tripped, @p@_is_exciting, @p@_sensor_invalid, @p@_q_fading,
    @p@_q_not_finite, @p@_q_count_wrong, @p@_q_checksum_wrong, @p@_q_not_loaded
};

@matrices@
/* Limits: INFINITY and a count of 0 switch a check off. */
typedef struct {
    @p@_real y[@q@], beta[@q@], u[@m@], rate[@m@];
    uint16_t clipped;  /* consecutive samples for which an input may be clipped */
    uint16_t stuck;    /* equal values after which an output counts as stuck, while excited */
    uint32_t host;     /* samples for which the host may be silent, while excited */
    uint32_t duration; /* longest excitation, samples */
} @p@_limits;

/* One sample of the log. */
typedef struct {
    uint64_t sample;
    @p@_real y[@q@], u[@m@], alpha[@m@], beta[@q@];
    /* Bits 0-1 phase, 2-3 bank of Q, 4 Q fades out, 5 clipped, 8-11 cause, 12-15 channel from 1, 16-23 invalid outputs. */
    uint32_t status;
} @p@_row;

typedef struct {
    uint16_t position, top;
    @p@_real step;
} @p@_ramp;

enum { @p@_empty, @p@_ready, @p@_connected, @p@_fading };

typedef struct {
    @p@_real q[@p@_q_count], x[YOULA_Q_ORDER];
    int role;
    @p@_ramp fade;
} @p@_bank;

typedef struct {
    @p@_limits limits;
    @p@_real xh[@x@], alpha[@m@], u[@m@], last[@q@];
    @p@_bank banks[2];
    int next; /* the bank to load, and to connect next */
    uint32_t loaded, checksum, silent, excited;
    uint16_t equal[@q@], clipped[@m@];
    unsigned char valid[@q@];
    @p@_ramp ramp;
    int phase;
    uint32_t cause, channel, pending;
    uint64_t sample;
} @p@_loop;

static inline int @p@_finite(@p@_real x) { return x - x == 0; }

/* sum += row times x. */
static inline @p@_real @p@_plus(@p@_real sum, const @p@_real *row, const @p@_real *x, int count)
{
    for (int j = 0; j < count; j++) {
        sum = sum + row[j] * x[j];
    }
    return sum;
}

static inline @p@_real @p@_minus(@p@_real sum, const @p@_real *row, const @p@_real *x, int count)
{
    for (int j = 0; j < count; j++) {
        sum = sum - row[j] * x[j];
    }
    return sum;
}

/* CRC-32 of Ethernet, four bits at a time, of the bytes of a number from the lowest on. */
static inline uint32_t @p@_crc(uint32_t crc, @p@_real value)
{
    static const uint32_t nibbles[16] = {
        0x00000000u, 0x1db71064u, 0x3b6e20c8u, 0x26d930acu, 0x76dc4190u, 0x6b6b51f4u, 0x4db26158u, 0x5005713cu,
        0xedb88320u, 0xf00f9344u, 0xd6d6a3e8u, 0xcb61b38cu, 0x9b64c2b0u, 0x86d3d2d4u, 0xa00ae278u, 0xbdbdf21cu
    };
    uint64_t bits = 0;
    uint32_t word;
    if (sizeof value == sizeof word) {
        memcpy(&word, &value, sizeof word);
        bits = word;
    } else {
        memcpy(&bits, &value, sizeof bits);
    }
    /* A char of a signal processor may have 16 bits. */
    for (unsigned k = 0; k < sizeof value * CHAR_BIT; k += 8) {
        uint32_t x = crc ^ (uint32_t)(bits >> k & 255);
        x = x >> 4 ^ nibbles[x & 15];
        crc = x >> 4 ^ nibbles[x & 15];
    }
    return crc;
}

static inline void @p@_ramp_init(@p@_ramp *r, uint16_t length)
{
    r->position = 0;
    r->top = length > 1 ? length : 1;
    r->step = (@p@_real)1 / (@p@_real)r->top;
}

static inline @p@_real @p@_weight(const @p@_ramp *r)
{
    return r->position == r->top ? (@p@_real)1 : (@p@_real)r->position * r->step;
}

static inline void @p@_fall(@p@_ramp *r, uint16_t by)
{
    r->position = (uint16_t)(r->position > by ? r->position - by : 0);
}

/* Out within 10 samples. The sum does not fit an int of 16 bits. */
static inline void @p@_drop(@p@_ramp *r) { @p@_fall(r, (uint16_t)(((uint32_t)r->top + 9) / 10)); }

static inline void @p@_bank_fade(@p@_bank *b, int fast)
{
    if (b->role == @p@_fading) {
        if (fast) {
            @p@_drop(&b->fade);
        } else {
            @p@_fall(&b->fade, 1);
        }
        if (b->fade.position == 0) {
            b->role = @p@_ready;
        }
    }
}

