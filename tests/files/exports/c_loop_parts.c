/* Prints what random events do not reach: refusals of limits and of shift registers, the sequence of every register, ends of ramps, counters
   at their ends, tables without rows. */
#include <math.h>
#include <stdio.h>
#include "loop.h"

static void refusals_of_limits(void)
{
    static loop_loop s;
    const loop_real wrong[] = {0, -1, NAN, INFINITY};
    for (int place = 0; place < 10; place++) {
        for (int k = 0; k < 4; k++) {
            loop_limits limits = {{1, 1, 1}, {1, 1, 1}, {1, 1}, {1, 1}, 0, 0, 0, 0};
            loop_real *const all[4] = {limits.y, limits.beta, limits.u, limits.rate};
            const int of_y = place < 6;
            all[of_y ? place / 3 : 2 + (place - 6) / 2][of_y ? place % 3 : (place - 6) % 2] = wrong[k];
            printf("%d", loop_init(&s, &limits, 1));
        }
    }
    printf("\n");
}

static void registers(void)
{
    const loop_real amplitudes[2] = {1, 2};
    for (int order = 0; order < 32; order++) {
        const uint32_t last = ((uint32_t)1 << order) - 1, starts[4][2] = {{1, last}, {0, 1}, {1, 0}, {1, last + 1}};
        for (int k = 0; k < 4; k++) {
            loop_prbs prbs;
            const int done = loop_prbs_init(&prbs, order, (uint16_t)k, starts[k]);
            printf("%d", done);
            for (int sample = 0; done && sample < 500; sample++) {
                loop_real values[2];
                loop_prbs_next(&prbs, amplitudes, values);
                printf("%d", (int)(values[0] + values[1]) + 3);
            }
        }
        printf("\n");
    }
}

/* Samples until an excitation that grew for `grown` samples is out, after a stop and after a trip. */
static void ramps(void)
{
    const loop_limits limits = {{1, 1, 1}, {9, 9, 9}, {1, 1}, {1, 1}, 0, 0, 0, 0};
    const uint16_t lengths[] = {0, 1, 2, 9, 10, 11, 12, 65535};
    const loop_real still[2] = {0, 0}, far[3] = {2, 0, 0}, y[3] = {0, 0, 0};
    static loop_loop s;
    for (int k = 0; k < 8; k++) {
        for (int trip = 0; trip < 2; trip++) {
            const int grown = 12;
            int count = 0;
            memset(&s, 0xff, sizeof s);
            loop_init(&s, &limits, lengths[k]);
            loop_arm(&s);
            loop_start(&s);
            for (int sample = 0; sample < grown || loop_is_excited(&s); sample++) {
                loop_real u[2];
                loop_row row;
                loop_command(&s, still, u);
                loop_observe(&s, trip && sample == grown ? far : y, u, &row);
                if (sample + 1 == grown && !trip) {
                    loop_stop(&s);
                }
                count++;
            }
            printf("%d ", count);
        }
    }
    printf("\n");
}

/* Samples at which the status changes, with constant outputs and inputs at their limits. */
static void counters(uint16_t clipped, uint16_t stuck)
{
    const loop_limits limits = {{9, 9, 9}, {9, 9, 9}, {(loop_real)0.5, (loop_real)0.5}, {9, 9}, clipped, stuck, 0, 0};
    const loop_real wanted[2] = {5, 5}, y[3] = {1, 1, 1};
    static loop_loop s;
    uint32_t last = UINT32_MAX;
    memset(&s, 0xff, sizeof s);
    loop_init(&s, &limits, 1);
    /* One by one: the order of the arguments of a call is not fixed. */
    printf("%d ", loop_write_q(&s, 1));
    printf("%d ", loop_commit_q(&s, 1));
    printf("%d ", loop_commit_q(&s, 0));
    printf("%d ", loop_switch_q(&s));
    printf("%d:", loop_arm(&s));
    for (long sample = 0; sample < 140000; sample++) {
        loop_real u[2];
        loop_row row;
        if (sample == 3) {
            loop_start(&s);
        }
        loop_command(&s, wanted, u);
        loop_observe(&s, y, u, &row);
        if (row.status != last) {
            printf(" %ld %lx", sample, (unsigned long)row.status);
        }
        last = row.status;
    }
    printf("\n");
}

int main(void)
{
    uint32_t place = 0;
    loop_real values[2] = {1, 1};
    refusals_of_limits();
    registers();
    ramps();
    counters(3, 0);
    counters(0, 0);
    counters(0, UINT16_MAX);
    loop_table_next(NULL, 0, &place, values);
    printf("%d %d %d\n", values[0] == 0, values[1] == 0, (int)place);
    return 0;
}
