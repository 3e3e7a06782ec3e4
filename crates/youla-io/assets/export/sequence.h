/*
@heading@
 *
 * One row for each sample, one column for each input: in sample k add @p@_values[k][j] to input j at the port,
 * for k = 0 to @p@_samples - 1, and 0 before and after.
 *
 * C99 without any dependency. Double precision, or single with -DYOULA_REAL=float.
 */
@real@
enum { @p@_samples = @n@, @p@_inputs = @m@ };

/* Seconds between two samples. */
static const @p@_real @p@_sample_time = @ts@;

static const @p@_real @p@_values[@n@][@m@] = {
@values@};

#endif
