// Sensor files for which the program and the core must have the same words: {file name: text}. The first ones are good.
const kCamera = 'camera: {width: 640, height: 480, fx: 700, fy: 700, cx: 319.5, cy: 239.5}\n';
const kTarget = 'target: {family: aruco_original, tag_size_mm: 3.8, border_mm: 0.35, tags: [{id: 5}, {id: 2}]}\n';
const kSprings = 'springs: {centres_mm: [[-7.5, -6.5, -10.9], [7.5, 6.5, -10.9]], axial_n_per_mm: 0.7, lateral_n_per_mm: 0.07}';
const kWrench = `wrench: {${kSprings}}\n`;
const kRight = kCamera + kTarget + kWrench;

export const calibration = (changes = {}) =>
  JSON.stringify({
    format: 'tagwrench-calibration-1',
    sensor: { family: 'aruco_original', tag_ids: [5, 2], tag_size_mm: 3.8, image_px: [640, 480], lens_px: [700, 700, 319.5, 239.5] },
    K: Array.from({ length: 6 }, (_, r) => Array.from({ length: 6 }, (_, c) => (r === c ? 100 + r : c / 10))),
    B: [0.1, 0, 0, 0, 0, 0.001],
    range: [1, 1, 2.5, 0.02, 0.02, 0.01],
    ...changes,
  });

const calibrated = (file) => `${kCamera}${kTarget}wrench: {calibration: ${file}}\n`;

/** By the file's name; what a sensor file names lies beside it. */
export const kFiles = {
  'right.json': calibration(),
  'other_ids.json': calibration({ sensor: { family: 'aruco_original', tag_ids: [5, 3], tag_size_mm: 3.8, image_px: [640, 480] } }),
  'other_target.json': calibration({
    sensor: { family: 'aruco_original', tag_ids: [5, 2], tag_size_mm: 3.8, image_px: [640, 480], target_sha256: '00'.repeat(32) },
  }),
  'cut.json': calibration().slice(0, 200),
  'nan.json': calibration().replace('0.1', '1e999'),
  'empty.png': 'no picture',
};

export const kSensors = {
  'right.yaml': kRight,
  'calibrated.yaml': calibrated('right.json'),
  'every_key.yaml': `camera:
  {width: 640, height: 480, fx: 700.5, fy: 701, cx: 319.5, cy: 239.5, distortion: [-0.06, 0.02, 4.0e-4, -3.0e-4, 0], mirrored: true,
   readout_ms: 12.5, latency_ms: 8, calibrated: {date: 2026-01-31, views: 30, rms_px: 0.2}}
target:
  family: apriltag_36h11
  tag_size_mm: 3.8
  border_mm: 0.4
  tags:
    - {id: 500, position_mm: [0, -1.6, 0], rotation_rad: [-0.8, 0, 0], position_sigma_mm: [0.01, 0.01, 0.02], rotation_sigma_rad: [0.001, 0.001, 0.001]}
    - {id: 7, position_mm: [0, 1.6, 0], rotation_rad: [0.8, 0, 0]}
rest: {frames: 10, position_mm: [0, 0, 21], rotation_rad: [0, 0.1, 0]}
wrench:
  ${kSprings}
  range_n: [0.9, 0.9, 2.5]
  range_nm: [0.016, 0.016, 0.009]
  origin_mm: [0, 0, -5]
  frame_rotation_rad: [0, 0, 0.5]
  zero_n: [0.01, 0, 0]
  zero_nm: [0, 0, 0]
  zero_date: '2026-02-03'
  zero_tracking: true
  zero_band_percent: 2
  zero_rate_percent_per_s: 0.01
mounting: {right: +x, toward_user: +y, down: +z}
shaping: {full_scale_n: [1, 1, 2], full_scale_nm: [0.02, 0.02, 0.01], dead_zone_n: [0, 0, 0.1], dead_zone_nm: [0, 0, 0]}
spacemouse: {id: "256f:c62e"}
`,
  'no_yaml.yaml': 'camera: {width: 640\n',
  'tab.yaml': 'camera:\n\twidth: 640\n',
  'list.yaml': '- 1\n- 2\n',
  'nothing.yaml': '# only a comment\n',
  'no_camera.yaml': kTarget + kWrench,
  'unknown_key.yaml': kRight + 'colour: red\n',
  'twice.yaml': kRight + kWrench,
  'text_for_number.yaml': kRight.replace('fx: 700', 'fx: wide'),
  'nan.yaml': kRight.replace('fx: 700', 'fx: .nan'),
  'huge.yaml': kRight.replace('cx: 319.5', 'cx: 1e300'),
  'fraction.yaml': kRight.replace('width: 640', 'width: 640.5'),
  'family.yaml': kRight.replace('aruco_original', 'aruco_3x3_50'),
  'id.yaml': kRight.replace('id: 2', 'id: 1024'),
  'same_id.yaml': kRight.replace('id: 2', 'id: 5'),
  'no_tags.yaml': kRight.replace('[{id: 5}, {id: 2}]', '[]'),
  'half_a_pose.yaml': kRight.replace('{id: 2}', '{id: 2, position_mm: [0, 0, 0]}'),
  'folded.yaml': kRight.replace('cy: 239.5', 'cy: 239.5, distortion: [-9, 0, 0, 0, 0]'),
  'no_model.yaml': kCamera + kTarget + 'wrench: {range_n: [1, 1, 1]}\n',
  'negative_spring.yaml': kRight.replace('0.07', '-0.07'),
  'no_calibration.yaml': calibrated('nowhere.json'),
  'of_another_sensor.yaml': calibrated('other_ids.json'),
  'of_another_target.yaml': calibrated('other_target.json'),
  'cut_calibration.yaml': calibrated('cut.json'),
  'infinite_calibration.yaml': calibrated('nan.json'),
  'no_picture.yaml': kRight + 'rest: {position_mm: [0, 0, 21], rotation_rad: [0, 0, 0], appearance: nowhere.png}\n',
  'bad_picture.yaml': kRight + 'rest: {position_mm: [0, 0, 21], rotation_rad: [0, 0, 0], appearance: empty.png}\n',
  'reference.yaml': kRight.replace(`{${kSprings}}`, `{${kSprings}, reference: {}}`),
  'hid.yaml': kRight + 'spacemouse: {id: "046d:c626"}\n',
};
