static inline void @p@_restart(@p@_loop *s)
{
    s->silent = s->excited = 0;
    memset(s->clipped, 0, sizeof s->clipped);
}

/* Allows a start, and clears the last trip. */
static inline int @p@_arm(@p@_loop *s)
{
    if (@p@_is_excited(s)) {
        return @p@_is_exciting;
    }
    for (int i = 0; i < @q@; i++) {
        if (!s->valid[i]) {
            return @p@_sensor_invalid;
        }
    }
    s->phase = @p@_armed;
    s->cause = s->channel = 0;
    @p@_restart(s);
    return @p@_done;
}

/* Starts the excitation at the next sample. */
static inline int @p@_start(@p@_loop *s)
{
    if (s->phase != @p@_armed) {
        return @p@_not_armed;
    }
    @p@_restart(s);
    s->phase = @p@_exciting;
    return @p@_done;
}

/* Ramps the excitation out. A trip stays until the loop is armed. */
static inline void @p@_stop(@p@_loop *s) { s->phase = s->phase == @p@_tripped ? @p@_tripped : @p@_idle; }

/* The host has been heard. */
static inline void @p@_heard(@p@_loop *s) { s->silent = 0; }

/* Begins to load Q into the bank that does not run. */
static inline int @p@_begin_q(@p@_loop *s)
{
    if (s->banks[s->next].role == @p@_fading) {
        return @p@_q_fading;
    }
    s->banks[s->next].role = @p@_empty;
    s->loaded = 0;
    s->checksum = 0xffffffffu;
    return @p@_done;
}

static inline int @p@_refused(@p@_loop *s, int why)
{
    if (@p@_is_excited(s)) {
        s->pending = @p@_q_refused;
    }
    return why;
}

/* The next coefficient. */
static inline int @p@_write_q(@p@_loop *s, @p@_real value)
{
    @p@_bank *bank = &s->banks[s->next];
    if (bank->role != @p@_empty || s->loaded >= @p@_q_count) {
        return @p@_refused(s, @p@_q_count_wrong);
    }
    if (!@p@_finite(value)) {
        s->loaded = @p@_q_count + 1;
        return @p@_refused(s, @p@_q_not_finite);
    }
    bank->q[s->loaded++] = value;
    s->checksum = @p@_crc(s->checksum, value);
    return @p@_done;
}

/* Declares Q complete; `checksum` is the CRC-32 of the bytes of its coefficients. */
static inline int @p@_commit_q(@p@_loop *s, uint32_t checksum)
{
    if (s->banks[s->next].role != @p@_empty || s->loaded != @p@_q_count) {
        return @p@_refused(s, @p@_q_count_wrong);
    }
    if ((s->checksum ^ 0xffffffffu) != checksum) {
        return @p@_refused(s, @p@_q_checksum_wrong);
    }
    s->banks[s->next].role = @p@_ready;
    return @p@_done;
}

/* Connects the Q that was loaded last, or after a switch the one before it, at the next sample and without a bump. */
static inline int @p@_switch_q(@p@_loop *s)
{
    @p@_bank *bank = &s->banks[s->next];
    if (s->phase == @p@_tripped) {
        return @p@_has_tripped;
    }
    if (bank->role == @p@_fading) {
        return @p@_q_fading;
    }
    if (bank->role != @p@_ready) {
        return @p@_q_not_loaded;
    }
    @p@_disconnect(s);
    memset(bank->x, 0, sizeof bank->x);
    bank->role = @p@_connected;
    s->next = 1 - s->next;
    return @p@_done;
}

/* Q = 0: back to the controller K, without a bump. */
static inline void @p@_release_q(@p@_loop *s) { @p@_disconnect(s); }

/* A pseudo-random binary sequence for each input from a shift register. */
typedef struct {
    uint32_t registers[@m@], mask;
    uint16_t hold, left;
} @p@_prbs;

/* A period of 2^order - 1 values of `hold` samples; each input has a start of its own between 1 and the period. 0 for an
   order without a primitive trinomial (3 to 7, 9, 10, 11, 15, 17, 18, 20 and 23 have one) or a start out of range. */
static inline int @p@_prbs_init(@p@_prbs *s, int order, uint16_t hold, const uint32_t starts[@m@])
{
    static const unsigned char second[24] = {0, 0, 0, 2, 3, 3, 5, 6, 0, 5, 7, 9, 0, 0, 0, 14, 0, 14, 11, 0, 17, 0, 0, 18};
    if (order < 3 || order > 23 || second[order] == 0) {
        return 0;
    }
    s->mask = (uint32_t)1 << (order - 1) | (uint32_t)1 << (second[order] - 1);
    s->hold = s->left = hold > 1 ? hold : 1;
    for (int i = 0; i < @m@; i++) {
        if (starts[i] < 1 || starts[i] >= (uint32_t)1 << order) {
            return 0;
        }
        s->registers[i] = starts[i];
    }
    return 1;
}

/* The values of this sample. */
static inline void @p@_prbs_next(@p@_prbs *s, const @p@_real amplitudes[@m@], @p@_real values[@m@])
{
    s->left--;
    for (int i = 0; i < @m@; i++) {
        values[i] = s->registers[i] & 1 ? amplitudes[i] : -amplitudes[i];
        if (s->left == 0) {
            s->registers[i] = s->registers[i] >> 1 ^ (s->registers[i] & 1 ? s->mask : 0);
        }
    }
    s->left = s->left == 0 ? s->hold : s->left;
}

/* One line of a multisine: input i gets gains[i][0] cos(w k) + gains[i][1] sin(w k). */
typedef struct {
    @p@_real cosine, sine, gains[@m@][2];
} @p@_tone;

/* The values of this sample: one phasor for each line turns, and starts again after each period. Set *place to 0 at first. */
static inline void @p@_multisine_next(const @p@_tone *tones, @p@_real (*phasors)[2], int lines, uint32_t period,
                                      uint32_t *place, @p@_real values[@m@])
{
    for (int i = 0; i < @m@; i++) {
        values[i] = 0;
    }
    for (int t = 0; t < lines; t++) {
        @p@_real c = phasors[t][0], s = phasors[t][1];
        if (*place == 0) {
            c = 1;
            s = 0;
        }
        for (int i = 0; i < @m@; i++) {
            values[i] = values[i] + tones[t].gains[i][0] * c + tones[t].gains[i][1] * s;
        }
        phasors[t][0] = tones[t].cosine * c - tones[t].sine * s;
        phasors[t][1] = tones[t].sine * c + tones[t].cosine * s;
    }
    *place = *place + 1 < period ? *place + 1 : 0;
}

/* The values of this sample from a table of `count` rows, which repeats; zeros without rows. Set *place to 0 at first. */
static inline void @p@_table_next(const @p@_real (*rows)[@m@], uint32_t count, uint32_t *place, @p@_real values[@m@])
{
    for (int i = 0; i < @m@; i++) {
        values[i] = *place < count ? rows[*place][i] : 0;
    }
    *place = *place + 1 < count ? *place + 1 : 0;
}

#endif
