function transientcam_frame(url)
%TRANSIENTCAM_FRAME  One frame of a camera over HTTP, in MATLAB or GNU Octave.
%   transientcam_frame('http://127.0.0.1:8000')
%
%   The tests run this file with GNU Octave, which reads with webread, but can neither send JSON nor
%   save with a header and leaves that to curl. The branches for MATLAB (webwrite, websave) follow
%   its documentation and were not run there.

  if nargin < 1
    url = 'http://127.0.0.1:8000';
  end
  api = [url '/api/v1'];

  camera = get_json([api '/camera']);
  capabilities = camera.capabilities;
  fprintf('%s, %d x %d pixels\n', capabilities.model, capabilities.width, capabilities.height);

  % what is not named gets its default; the answer says what was really set
  wanted = struct('base_frequency_hz', 23e6, 'harmonics', 3, 'zeroth', 'estimated', ...
                  'exposure_s', 0.0005);
  applied = put_json([api '/sequence'], wanted);
  fprintf('%d images a frame at %.1f Hz\n', applied.images, applied.frame_rate_hz);

  range_m = get_npy([api '/frames/latest/range.npy?wait_s=10']);
  finite = range_m(isfinite(range_m));
  fprintf('range %d x %d, %.3f to %.3f m, median %.3f m\n', ...
          size(range_m, 1), size(range_m, 2), min(finite), max(finite), median(finite));

  % the light that has been under way for 11.3 and for 19.3 ns
  light = get_npy([api '/frames/latest/transient.npy?time_s=11.3e-9&time_s=19.3e-9']);
  fprintf('transient %d x %d x %d, brightest %.3g DN/s\n', ...
          size(light, 1), size(light, 2), size(light, 3), max(light(:)));

  pixel = get_json([api '/frames/latest/pixel?x=80&y=60&bins=16']);
  fprintf('pixel (80, 60): %.3f m, %d times of flight\n', pixel.range_m, numel(pixel.time_s));
end

function document = get_json(url)
  document = webread(url, options());
  if ischar(document)  % Octave hands over the text
    document = jsondecode(document);
  end
end

function document = put_json(url, value)
  if is_octave()
    command = sprintf('curl --silent --show-error --fail-with-body -X PUT %s --json ''%s'' ''%s''', ...
                      authorization(), jsonencode(value), url);
    [status, text] = system(command);
    if status ~= 0
      error('transientcam:refused', '%s', text);
    end
    document = jsondecode(text);
  else
    put = options();
    put.RequestMethod = 'put';
    put.MediaType = 'application/json';
    document = webwrite(url, value, put);
  end
end

function array = get_npy(url)
%GET_NPY  An array in NumPy's format: magic, version, length of a header, header, values.
  name = [tempname() '.npy'];
  if is_octave()
    command = sprintf('curl --silent --show-error --fail %s --output ''%s'' ''%s''', ...
                      authorization(), name, url);
    if system(command) ~= 0
      error('transientcam:refused', '%s could not be had', url);
    end
  else
    websave(name, url, options());
  end
  file = fopen(name, 'r', 'ieee-le');
  fseek(file, 8, 'bof');
  header = fread(file, fread(file, 1, 'uint16'), 'char=>char')';
  kind = regexp(header, '''descr'': ''(.*?)''', 'tokens', 'once');
  shape = regexp(header, '''shape'': \((.*?)\)', 'tokens', 'once');
  shape = sscanf(strrep(shape{1}, ',', ' '), '%d')';
  types = struct('f4', 'single', 'f8', 'double', 'u2', 'uint16', 'u1', 'uint8');
  array = fread(file, Inf, ['*' types.(kind{1}(2:3))]);
  fclose(file);
  delete(name);
  % NumPy's last axis runs fastest, MATLAB's first
  array = permute(reshape(array, [fliplr(shape) 1]), numel(shape):-1:1);
end

function chosen = options()
  chosen = weboptions('Timeout', 30);
  token = getenv('TRANSIENTCAM_TOKEN');
  if ~isempty(token)
    chosen.HeaderFields = {'Authorization', ['Bearer ' token]};
  end
end

function text = authorization()
% a token in the environment is no secret to this machine's own shell
  text = '';
  if ~isempty(getenv('TRANSIENTCAM_TOKEN'))
    text = '--header "Authorization: Bearer $TRANSIENTCAM_TOKEN"';
  end
end

function answer = is_octave()
  answer = exist('OCTAVE_VERSION', 'builtin') ~= 0;
end
