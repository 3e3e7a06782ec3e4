% One-step predictions of y from u and the past of y, samples x channels, as deviations from the mean of the record:
%     predicted = lsim(predictor, [u y]);
predictor = ss(predictor_a - predictor_k * predictor_c, [predictor_b - predictor_k * predictor_d, predictor_k], ...
    predictor_c, [predictor_d, zeros(size(predictor_covariance))], ts);
