// Jobs in the midst of it and at their end, as a bridge tells them.
const task = (text) => ({ kind: 'task', text });
const none = { live: '', coverage: null, progress: null, keys: [], result: null };

export const kJobs = {
  camera: {
    ...none,
    verb: 'camera',
    state: 'running',
    lines: [task('show the board at the lower right, tilted')],
    live: '7 views, board seen, sharp',
    coverage: {
      regions: [2, 3, 0, 5, 8, 1, 0, 2, 0],
      views: 7,
      wanted: 20,
      missing: ['top right', 'bottom left', 'bottom right'],
    },
    progress: 0.35,
    keys: ['stop'],
  },
  target: {
    ...none,
    verb: 'target',
    state: 'done',
    lines: [
      task('move the platform slowly in all six directions'),
      { kind: 'result', text: 'measured/target.yaml is written; 18 key frames fit to 0.021 px' },
    ],
    coverage: { range: [4e-4, 3e-4, 2e-4, 0.04, 0.03, 0.05], keyframes: 18, wanted: 20 },
    progress: 1,
  },
  wrench: {
    ...none,
    verb: 'wrench',
    state: 'running',
    live: 'steady for 0.6 of 1 s; reads Fz \u22120.49 N',
    coverage: { axes: [0.9, 0.4, 1, 0.2, 0.1, 0] },
    progress: 0.4,
    keys: ['skip', 'redo', 'stop'],
    lines: [
      { kind: 'note', text: 'plan six_orientations: one kitchen weight of 50 g and a string' },
      task('stand the sensor upright, as it is used'),
      { kind: 'warning', text: 'the weight swings; waiting' },
      task('put the 50 g on the right bolt'),
    ],
  },
  check: {
    ...none,
    verb: 'check',
    state: 'failed',
    lines: [{ kind: 'warning', text: 'one thing is off' }],
    result: {
      text: 'fine   light     the tags\u2019 white is at 171 of 255; 171 when calibrated\nfine   residual  1.3 % of the contrast is not explained\nOFF    tags      tag 2 has moved by 12.0 um against the other: fix it, then calibrate target again\n',
    },
  },
  certificate: {
    ...none,
    verb: 'certificate',
    state: 'done',
    lines: [{ kind: 'result', text: 'certificate 4f3a is written' }],
    result: {
      html: '/files/certificate.html',
      pdf: '/files/certificate.pdf',
      json: '/files/certificate.json',
    },
  },
  doctor: {
    ...none,
    verb: 'doctor',
    state: 'done',
    lines: [{ kind: 'result', text: 'two things to do' }],
    result: {
      text: 'ok  tagwrench 0.1.0, Linux 6.1\n--  no USB serial port: no board for light and load cells\n!!  /dev/uhid: the module is not loaded; needed for the outputs spacemouse and wrench: sudo modprobe uhid\n!!  spacenavd does not run: systemctl start spacenavd\n',
    },
  },
};
