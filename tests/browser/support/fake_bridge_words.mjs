// What a fake bridge says at first.
const kCurve = '{power: 1.6}';
const axis = (name, unit, full, dead) =>
  `  ${name}: {from: ${name}, invert: false, limit: 1, full_scale_${unit}: ${full}, dead_zone_${unit}: ${dead}, curve: ${kCurve}}\n`;

export const kProfileText =
  'name: "cad"\napplications: ["freecad", "blender"]\nrate_hz: 125\nfill: predict\naxes:\n' +
  axis('x', 'n', 0.6, 0.02) +
  axis('y', 'n', 0.6, 0.02) +
  axis('z', 'n', 2, 0.08) +
  axis('rx', 'nm', 0.012, 0.0006) +
  axis('ry', 'nm', 0.012, 0.0006) +
  axis('rz', 'nm', 0.008, 0.0003) +
  'dead_zone_release: 0.7\nnoise_sigmas: 8\nswing_ms: 120\ntranslation: 1\nrotation: 1\n' +
  'dominant: {on: false, ratio: 1.3}\nlock: none\nfilter: {kind: one_euro, cutoff_hz: 2, hz_per_speed: 12, speed_cutoff_hz: 3}\n' +
  'gestures: {tap: none, double_tap: button 1, press_hold: button 2, twist_left: none, twist_right: none, tap_force_n: 0.5, press_force_n: 1, twist_torque_nm: 0.003, press_ms: 500, hold_motion: true}\n';

export function fakeHello() {
  return {
    protocol: 1,
    version: '0.1.0',
    name: 'sensor',
    source: 'simulated sensor, 640x480 at 60 Hz',
    sensor: 'built in',
    camera: { width: 640, height: 480, mirrored: false },
    range_n: [1, 1, 3],
    range_nm: [0.018, 0.018, 0.012],
    calibrated: '2026-11-02',
    axes_from_springs: ['Fz'],
    folder: '/home/u/tagwrench',
    can: {
      camera_settings: true,
      led: true,
      cells: [0, 2],
      profiles: true,
      jobs: ['camera', 'target', 'wrench', 'check', 'zero', 'certificate', 'doctor'],
    },
  };
}

export function fakeState() {
  return {
    rate_hz: 60.02,
    latency_us: { median: 812, p99: 1540 },
    jitter_us: 120,
    dropped: 0,
    skipped: 1,
    frames: 0,
    status: 'ok',
    words: 'held',
    image: {
      white: 190,
      black: 40,
      clipped_part: 0.001,
      edges_px: [
        { id: 5, px: 1.1 },
        { id: 2, px: 2.4 },
      ],
      residual_part: 0.013,
    },
    profile: { name: 'cad', names: ['cad', 'game', 'research'], text: kProfileText, trial: false },
    zero_state: 'following',
    clients: [
      { name: 'freecad', by: 'spnav' },
      { name: 'spacenavd', by: 'hidraw' },
    ],
    recording: null,
    board: {
      led: 0.42,
      exposure_us: 2000,
      cells: [
        { channel: 0, n: 1.23, sigma_n: 0.01 },
        { channel: 2, n: -0.04, sigma_n: 0.01 },
      ],
    },
    camera_controls: [
      { id: 9963776, name: 'brightness', value: 0, minimum: -64, maximum: 64, step: 1, writable: true },
      {
        id: 10094850,
        name: 'exposure_time_absolute',
        value: 150,
        minimum: 1,
        maximum: 5000,
        step: 1,
        writable: true,
      },
      { id: 10094849, name: 'auto_exposure', value: 1, minimum: 0, maximum: 1, step: 1, writable: true },
      { id: 10094858, name: 'focus_absolute', value: 12, minimum: 0, maximum: 255, step: 1, writable: false },
    ],
    job: null,
  };
}
