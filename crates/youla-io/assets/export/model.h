/*
@heading@
 *
 *     y[k]   = C x[k] + D u[k]        @p@_output
 *     x[k+1] = A x[k] + B u[k]        @p@_update
 *
 * C99 without any dependency. Double precision, or single with -DYOULA_REAL=float, which
 * @single@.
 */
@real@
enum { @p@_states = @n@, @p@_inputs = @m@, @p@_outputs = @q@ };

/* The state x; set it to zero by @p@_reset. */
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

/* y from the state and the input of this sample. */
static inline void @p@_output(const @p@_state *s, const @p@_real u[@m@], @p@_real y[@q@])
{
@unused@    for (int i = 0; i < @q@; i++) {
        @p@_real sum = 0;
@output@        y[i] = sum;
    }
}

/* Goes on to the next sample. */
static inline void @p@_update(@p@_state *s, const @p@_real u[@m@])
{
@update@}

#endif
