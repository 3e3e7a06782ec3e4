/* Plays a script of events: for each sample the number of requests with their arguments, y, and what was applied. Writes the status
   and a hash of all that the loop returns. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include "loop.h"

static uint64_t hash;

static void add(uint64_t word)
{
    for (int k = 0; k < 8; k++) {
        hash = (hash ^ (word >> (8 * k) & 255)) * 0x100000001b3u;
    }
}

static void add_real(loop_real value)
{
    uint64_t bits = 0;
    uint32_t word;
    if (sizeof value == 4) {
        memcpy(&word, &value, 4);
        bits = word;
    } else {
        memcpy(&bits, &value, 8);
    }
    add(bits);
}

static uint64_t word(void)
{
    uint64_t found = 0;
    if (scanf("%" SCNx64, &found) != 1) {
        found = UINT64_MAX;
    }
    return found;
}

static loop_real real(void)
{
    const uint64_t bits = word();
    const uint32_t low = (uint32_t)bits;
    loop_real value;
    if (sizeof value == 4) {
        memcpy(&value, &low, 4);
    } else {
        memcpy(&value, &bits, sizeof value);
    }
    return value;
}

static void request(loop_loop *s)
{
    switch (word()) {
    case 1: add((uint64_t)loop_arm(s)); break;
    case 2: add((uint64_t)loop_start(s)); break;
    case 3: loop_stop(s); break;
    case 4: loop_heard(s); break;
    case 5: add((uint64_t)loop_begin_q(s)); break;
    case 6: add((uint64_t)loop_write_q(s, real())); break;
    case 7: add((uint64_t)loop_commit_q(s, (uint32_t)word())); break;
    case 8: add((uint64_t)loop_switch_q(s)); break;
    default: loop_release_q(s); break;
    }
}

int main(void)
{
    static loop_loop s;
    loop_prbs prbs;
    loop_tone tone = {0, 0, {{(loop_real)0.5, 0}, {0, (loop_real)0.25}}};
    loop_real phasors[1][2], levels[2] = {(loop_real)0.5, (loop_real)0.75}, of_prbs[2], of_tone[2], of_table[2];
    const uint32_t starts[2] = {1, 77};
    const loop_real rows[3][2] = {{(loop_real)0.25, 0}, {0, (loop_real)-0.125}, {(loop_real)-0.25, (loop_real)0.125}};
    uint32_t place = 0, row_of_table = 0;
    const loop_limits limits = {{50, 50, INFINITY}, {3, 3, INFINITY}, {8, 8}, {6, 6}, 3, 4, 20, 60};
    tone.cosine = real();
    tone.sine = real();
    if (loop_init(&s, &limits, 25) != 0 || !loop_prbs_init(&prbs, 10, 2, starts)) {
        return 1;
    }
    for (uint64_t requests = word(); requests != UINT64_MAX; requests = word()) {
        loop_real wanted[2], u[2], y[3], applied[2];
        loop_row row;
        hash = 0xcbf29ce484222325u;
        while (requests-- > 0) {
            request(&s);
        }
        loop_prbs_next(&prbs, levels, of_prbs);
        loop_multisine_next(&tone, phasors, 1, 50, &place, of_tone);
        loop_table_next(rows, 3, &row_of_table, of_table);
        for (int j = 0; j < 2; j++) {
            wanted[j] = of_prbs[j] + of_tone[j] + of_table[j] + real();
        }
        loop_command(&s, wanted, u);
        for (int j = 0; j < 3; j++) {
            y[j] = real();
        }
        for (int j = 0; j < 2; j++) {
            applied[j] = u[j] * real();
        }
        loop_observe(&s, y, applied, &row);
        for (int j = 0; j < 2; j++) {
            add_real(u[j]);
            add_real(row.u[j]);
            add_real(row.alpha[j]);
        }
        for (int j = 0; j < 3; j++) {
            add_real(row.y[j]);
            add_real(row.beta[j]);
        }
        add(row.sample);
        printf("%" PRIx32 " %" PRIx64 "\n", row.status, hash);
    }
    return 0;
}
