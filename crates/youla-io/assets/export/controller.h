/*
@heading@
 *
 *     u      = Kx x + Ky y + Ka alpha      @p@_command: @timing@
 *     beta   = C x + Eu u + Ey y           @p@_observe, with the u that the actuators really applied
 *     x[k+1] = A x + Bu u + By y
 *
 * alpha is the excitation of the experiment, one value for each input and sample; zeros where there
 * is none. Log u as applied and y. A u that is not the command, by saturation or a safety stop, does no
 * harm: beta stays right and nothing winds up.
 *
 *     @p@_state s;
 *     @p@_reset(&s);
 *     each sample:
 *         @p@_command(&s, y, alpha, u);     limit u, apply it
 *         @p@_observe(&s, y, u, beta);
 *
 * C99 without any dependency. Double precision, or single with -DYOULA_REAL=float, which
 * @single@.
 */
@real@
enum { @p@_states = @n@, @p@_inputs = @m@, @p@_outputs = @q@ };

/* The state x of the left factors; set it to zero by @p@_reset. */
typedef struct {
    @p@_real x[@x@];
} @p@_state;

@matrices@
/* x = 0. */
static inline void @p@_reset(@p@_state *s)
{
    for (int i = 0; i < @x@; i++) {
        s->x[i] = 0;
    }
}

/* The command u; @timing@. */
static inline void @p@_command(const @p@_state *s, const @p@_real y[@q@], const @p@_real alpha[@m@], @p@_real u[@m@])
{
@unused@    for (int i = 0; i < @m@; i++) {
        @p@_real sum = 0;
@command@        u[i] = sum;
    }
}

/* beta from y and the u that was applied, then on to the next sample. */
static inline void @p@_observe(@p@_state *s, const @p@_real y[@q@], const @p@_real u[@m@], @p@_real beta[@q@])
{
    for (int i = 0; i < @q@; i++) {
        @p@_real sum = 0;
@beta@        beta[i] = sum;
    }
@update@}

#endif
