/* The outputs of the banks in a role, each times its weight. */
static inline void @p@_q_output(const @p@_loop *s, int role, @p@_real sum[@m@])
{
    const int k = YOULA_Q_ORDER;
    for (int i = 0; i < @m@; i++) {
        sum[i] = 0;
    }
    for (int b = 0; b < 2; b++) {
        const @p@_bank *bank = &s->banks[b];
        if (bank->role != role) {
            continue;
        }
        const @p@_real weight = role == @p@_fading ? @p@_weight(&bank->fade) : (@p@_real)1;
        const @p@_real *c = bank->q + k * (k + @q@);
        for (int i = 0; i < @m@; i++) {
            sum[i] = sum[i] + @p@_plus(0, c + i * k, bank->x, k) * weight;
        }
    }
}

/* 0 where the state overflowed. */
static inline int @p@_bank_advance(@p@_bank *b, const @p@_real beta[@q@], int tripped)
{
    const int k = YOULA_Q_ORDER;
    if (b->role == @p@_empty || b->role == @p@_ready) {
        return 1;
    }
    @p@_real next[YOULA_Q_ORDER];
    int finite = 1;
    for (int i = 0; i < k; i++) {
        next[i] = @p@_plus(0, b->q + i * k, b->x, k);
        if (b->role == @p@_connected) {
            next[i] = @p@_plus(next[i], b->q + k * k + i * @q@, beta, @q@);
        }
    }
    for (int i = 0; i < k; i++) {
        b->x[i] = next[i];
        finite = finite && @p@_finite(next[i]);
    }
    @p@_bank_fade(b, tripped);
    if (!finite) {
        memset(b->x, 0, sizeof b->x);
        b->role = @p@_empty;
    }
    return finite;
}

static inline void @p@_disconnect(@p@_loop *s)
{
    for (int b = 0; b < 2; b++) {
        if (s->banks[b].role == @p@_connected) {
            s->banks[b].role = @p@_fading;
            s->banks[b].fade.position = s->banks[b].fade.top;
        }
    }
}

/* At rest, with Q = 0. An excitation grows and falls over `ramp` samples; a Q that is replaced fades as slowly. */
static inline int @p@_init(@p@_loop *s, const @p@_limits *limits, uint16_t ramp)
{
    for (int i = 0; i < @q@; i++) {
        if (!(limits->y[i] > 0 && limits->beta[i] > 0)) {
            return @p@_limits_not_positive;
        }
    }
    for (int i = 0; i < @m@; i++) {
        if (!(limits->u[i] > 0 && limits->rate[i] > 0)) {
            return @p@_limits_not_positive;
        }
    }
    memset(s, 0, sizeof *s);
    s->limits = *limits;
    s->loaded = @p@_q_count;
    s->checksum = 0xffffffffu;
    memset(s->valid, 1, sizeof s->valid);
    @p@_ramp_init(&s->ramp, ramp);
    @p@_ramp_init(&s->banks[0].fade, ramp);
    @p@_ramp_init(&s->banks[1].fade, ramp);
    return @p@_done;
}

/* Whether the source of the excitation is in use. */
static inline int @p@_is_excited(const @p@_loop *s) { return s->phase == @p@_exciting || s->ramp.position != 0; }

/* First phase: the input to apply. */
static inline void @p@_command(@p@_loop *s, const @p@_real wanted[@m@], @p@_real u[@m@])
{
    @p@_real port[@m@];
    @p@_q_output(s, @p@_fading, s->alpha);
    if (@p@_is_excited(s)) {
        const @p@_real weight = @p@_weight(&s->ramp);
        int finite = 1;
        for (int i = 0; i < @m@; i++) {
            finite = finite && @p@_finite(wanted[i]);
        }
        for (int i = 0; finite && i < @m@; i++) {
            s->alpha[i] = s->alpha[i] + wanted[i] * weight;
        }
        if (!finite) {
            s->pending = @p@_excitation_not_finite;
        }
    }
    @p@_q_output(s, @p@_connected, port);
    for (int i = 0; i < @m@; i++) {
        const @p@_real given = @p@_plus(port[i] + s->alpha[i], @f@, s->xh, @n@);
        const @p@_real last = s->u[i], limit = s->limits.u[i], low = last - s->limits.rate[i], high = last + s->limits.rate[i];
        /* Off where the state was not finite: the input before is. */
        @p@_real x = @p@_finite(given) ? given : last;
        x = x < low ? low : x > high ? high : x;
        x = x < -limit ? -limit : x > limit ? limit : x;
        s->clipped[i] = (uint16_t)(x == given ? 0 : s->clipped[i] < 65535 ? s->clipped[i] + 1 : 65535);
        s->u[i] = x;
        u[i] = x;
    }
}

static inline void @p@_find(uint32_t found[2], uint32_t cause, uint32_t channel)
{
    if (found[0] == 0) {
        found[0] = cause;
        found[1] = channel;
    }
}

/* Which outputs are valid, and whether one trips. */
static inline void @p@_outputs_checked(@p@_loop *s, const @p@_real y[@q@], int excited, uint32_t found[2])
{
    const uint32_t most = s->limits.stuck;
    for (int i = 0; i < @q@; i++) {
        const int finite = @p@_finite(y[i]);
        s->equal[i] = (uint16_t)(y[i] == s->last[i] ? (s->equal[i] < 65535 ? s->equal[i] + 1 : 65535) : 0);
        s->last[i] = y[i];
        const uint32_t same = s->equal[i] < 65535 ? s->equal[i] + 1u : 65535u;
        /* A channel that was found stuck stays so until it moves. */
        const int stuck = most > 0 && same >= most && (excited || (!s->valid[i] && finite));
        s->valid[i] = (unsigned char)(finite && !stuck);
        if (!finite) {
            @p@_find(found, @p@_sensor_not_finite, (uint32_t)i + 1);
        } else if (stuck) {
            @p@_find(found, @p@_sensor_stuck, (uint32_t)i + 1);
        } else if ((y[i] < 0 ? -y[i] : y[i]) > s->limits.y[i]) {
            @p@_find(found, @p@_output_limit, (uint32_t)i + 1);
        }
    }
}

/* The residuals, the inputs and the times. */
static inline void @p@_rest_checked(@p@_loop *s, const @p@_real beta[@q@], int excited, uint32_t found[2])
{
    for (int i = 0; i < @q@; i++) {
        if ((beta[i] < 0 ? -beta[i] : beta[i]) > s->limits.beta[i]) {
            @p@_find(found, @p@_residual_limit, (uint32_t)i + 1);
        }
    }
    for (int i = 0; i < @m@; i++) {
        if (s->limits.clipped > 0 && s->clipped[i] > s->limits.clipped) {
            @p@_find(found, @p@_input_limit, (uint32_t)i + 1);
        }
    }
    if (excited) {
        s->silent += s->silent < UINT32_MAX;
        s->excited += s->excited < UINT32_MAX;
        if (s->limits.host > 0 && s->silent > s->limits.host) {
            @p@_find(found, @p@_host_silent, 0);
        }
        if (s->limits.duration > 0 && s->excited > s->limits.duration) {
            @p@_find(found, @p@_time_over, 0);
        }
    }
}

static inline uint32_t @p@_status(const @p@_loop *s)
{
    uint32_t bits = (uint32_t)s->phase | s->cause << 8 | (s->channel < 15 ? s->channel : 15) << 12;
    for (int i = 0; i < @q@ && i < 8; i++) {
        bits |= s->valid[i] ? 0 : (uint32_t)1 << (16 + i);
    }
    for (int b = 0; b < 2; b++) {
        bits |= s->banks[b].role == @p@_connected ? (uint32_t)(b + 1) << 2 : 0;
        bits |= s->banks[b].role == @p@_fading ? 1u << 4 : 0;
    }
    for (int i = 0; i < @m@; i++) {
        bits |= s->clipped[i] > 0 ? 1u << 5 : 0;
    }
    return bits & 0xffffffu;
}

/* xh+ = A xh + B u - L beta; 0 where the state overflowed. */
static inline int @p@_advance(@p@_loop *s, const @p@_real beta[@q@])
{
    @p@_real next[@x@];
    int finite = 1;
    for (int i = 0; i < @n@; i++) {
        next[i] = @p@_minus(@p@_plus(@p@_plus(0, @a@, s->xh, @n@), @b@, s->u, @m@), @l@, beta, @q@);
        finite = finite && @p@_finite(next[i]);
    }
    for (int i = 0; i < @n@; i++) {
        s->xh[i] = finite ? next[i] : 0;
    }
    return finite;
}

/* Second phase: the measurement and the input that was applied; the row of the log. */
static inline void @p@_observe(@p@_loop *s, const @p@_real y[@q@], const @p@_real applied[@m@], @p@_row *row)
{
    const int excited = s->phase == @p@_exciting, tripped = s->phase == @p@_tripped;
    uint32_t found[2] = {0, 0};
    int finite = 1;
    for (int i = 0; i < @m@; i++) {
        finite = finite && @p@_finite(applied[i]);
    }
    for (int i = 0; finite && i < @m@; i++) {
        s->u[i] = applied[i];
    }
    @p@_find(found, s->pending, 0);
    s->pending = 0;
    @p@_outputs_checked(s, y, excited, found);
    for (int i = 0; i < @q@; i++) {
        const @p@_real beta = @p@_minus(@p@_minus(y[i], @c@, s->xh, @n@), @d@, s->u, @m@);
        /* An output that is not used is taken as predicted. */
        row->beta[i] = s->valid[i] ? beta : 0;
        row->y[i] = y[i];
    }
    @p@_rest_checked(s, row->beta, excited, found);
    finite = @p@_advance(s, row->beta);
    finite = @p@_bank_advance(&s->banks[0], row->beta, tripped) && finite;
    finite = @p@_bank_advance(&s->banks[1], row->beta, tripped) && finite;
    @p@_find(found, finite ? 0 : @p@_state_not_finite, 0);
    if (excited) {
        s->ramp.position = (uint16_t)(s->ramp.position < s->ramp.top ? s->ramp.position + 1 : s->ramp.top);
    } else if (tripped) {
        @p@_drop(&s->ramp);
    } else {
        @p@_fall(&s->ramp, 1);
    }
    /* The first cause counts. The excitation and Q are on their way out from the next sample on. */
    if (found[0] != 0 && !tripped) {
        s->phase = @p@_tripped;
        s->cause = found[0];
        s->channel = found[1];
        @p@_drop(&s->ramp);
        @p@_disconnect(s);
        @p@_bank_fade(&s->banks[0], 1);
        @p@_bank_fade(&s->banks[1], 1);
    }
    for (int i = 0; i < @m@; i++) {
        row->u[i] = s->u[i];
        row->alpha[i] = s->alpha[i];
    }
    row->status = @p@_status(s);
    row->sample = s->sample++;
}

