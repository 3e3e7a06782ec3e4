@heading@
%
%     x[k+1] = a x[k] + b u[k]
%     y[k]   = c x[k] + d u[k]
%
% Needs the Control System Toolbox, or the package control of Octave.

ts = @ts@; % seconds
@matrices@
if exist('OCTAVE_VERSION', 'builtin')
    pkg load control
end
G = ss(a, b, c, d, ts, 'InputName', {@inputs@}, 'OutputName', {@outputs@});
@predictor@@predict@