

def predict(u, y):
    """One-step predictions of y from u and the past of y, samples x channels, as deviations from the mean of the record."""
    u, y = np.asarray(u, float).reshape(len(u), -1), np.asarray(y, float).reshape(len(y), -1)
    x, predicted = np.zeros(len(predictor_a)), np.empty_like(y)
    for k in range(len(y)):
        predicted[k] = predictor_c @ x + predictor_d @ u[k]
        x = predictor_a @ x + predictor_b @ u[k] + predictor_k @ (y[k] - predicted[k])
    return predicted
