% Builds the gateway and runs it: octave run_stage_x.m, or run_stage_x in MATLAB. First: hystgen emit stage_x.yaml -o .
mex stage_x_mex.c stage_x.c

t = (0:1e-3:2)';
u = 20 + 15 * sin(2 * pi * t) .* exp(-t / 2);  % um

inverse = stage_x_mex('inverse');
forward = stage_x_mex('forward');
v = stage_x_mex('step', inverse, u);
y = stage_x_mex('step', forward, v);
fprintf('%d samples, largest error of the model behind its inverse: %.1e um\n', numel(u), max(abs(y - u)));
fprintf('without the inverse: %.2f um\n', max(abs(stage_x_mex('step', stage_x_mex('forward'), u / 0.42) - u)));

other = stage_x_mex('inverse');  % instances are independent
for k = 1:numel(u)
    w(k, 1) = stage_x_mex('step', other, u(k));
end
fprintf('sample by sample in another instance: %d drives differ\n', sum(w ~= v));
stage_x_mex('step', other, 1000);
fprintf('status after a reference out of range: %d\n', stage_x_mex('status', other));
stage_x_mex('free', other);

drives = fopen('drives.bin', 'w');
fwrite(drives, [u v], 'double');
fclose(drives);
