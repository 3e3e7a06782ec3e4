% n4sid of Octave's control package: FOLDER=.. HORIZON=.. ORDER=.. ALGORITHM=.. octave-cli octave.m; prints what slicot.py prints.
pkg load control
warning("off", "all");
folder = getenv("FOLDER"); s = str2double(getenv("HORIZON")); n = str2double(getenv("ORDER"));
function x = numbers(folder, name)
  channels = str2double(fileread([folder "/channels"]));
  file = fopen([folder "/" name]); x = reshape(fread(file, Inf, "double"), [], channels); fclose(file);
end
function mb = memory(key)
  mb = str2double(regexp(fileread("/proc/self/status"), [key ':\s+(\d+)'], 'tokens'){1}{1}) / 1024;
end
u = numbers(folder, "u"); y = numbers(folder, "y"); uv = numbers(folder, "uv")'; yv = numbers(folder, "yv");
identify = @(u, y) n4sid(iddata(y, u, 1), n, "s", s, "alg", getenv("ALGORITHM"));
identify(u(1:2000,:), y(1:2000,:));
before = memory("VmRSS"); times = [];
while (isempty(times) || (sum(times) < 1 && numel(times) < 15))
  tic; model = identify(u, y); times(end+1) = toc;
end
used = max(0, memory("VmHWM") - before);
[a, b, c, d] = ssdata(model);
x = zeros(n, 1); simulated = zeros(size(yv));
for k = 1:rows(yv) simulated(k,:) = (c * x + d * uv(:,k))'; x = a * x + b * uv(:,k); end
fit = 100 * min(1 - norm(yv - simulated, 2, "columns") ./ norm(yv - mean(yv), 2, "columns"));
printf("%.9g %.6f %.1f\n", median(times), fit, used);
