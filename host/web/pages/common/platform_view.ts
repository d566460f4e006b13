// The platform on its springs, moved more than it moves, with the arrows of force and torque. World axes are
// the camera's: x right, y away from the user, z up from the lens, as the sensor stands on a table.
import {
  AmbientLight,
  BoxGeometry,
  ConeGeometry,
  CylinderGeometry,
  DirectionalLight,
  Group,
  Mesh,
  MeshLambertMaterial,
  Object3D,
  PerspectiveCamera,
  Quaternion,
  Scene,
  TorusGeometry,
  Vector3,
  WebGLRenderer,
} from 'three';
import './platform_view.css';
import { Orbit } from './orbit';
import { make, present, say } from './elements';
import { ARROW_FOOT, FARTHEST_MOVE, FIELD_DEG, TIP_LENGTH, forceArrow } from './force_arrow';
import { axesTriad, setTriadColours, spring } from './platform_parts';
import { AXES, type Sample, carriesNumbers, figure } from './sample';
import { colour, onTheme } from './theme';

const BASE_Z = -0.022;
const SPRING_FEET: readonly (readonly [number, number])[] = [
  [0.014, 0.011],
  [-0.014, 0.011],
  [0.014, -0.011],
  [-0.014, -0.011],
];
const EXAGGERATION = 10;
const ARC_RADIUS = 0.024;
const LEAST_PART = 0.01;
const UP = new Vector3(0, 0, 1);

/** Between two pictures where the processor draws them: they would cost the traces their smoothness. */
const SOFTWARE_EVERY_MS = 100;

type Drawing = 'none' | 'software' | 'hardware';

function drawingHere(): Drawing {
  const tries = (options: WebGLContextAttributes): boolean => {
    const context = document.createElement('canvas').getContext('webgl2', options);
    context?.getExtension('WEBGL_lose_context')?.loseContext();
    return context !== null;
  };
  return tries({ failIfMajorPerformanceCaveat: true }) ? 'hardware' : tries({}) ? 'software' : 'none';
}

interface Materials {
  base: MeshLambertMaterial;
  plate: MeshLambertMaterial;
  spring: MeshLambertMaterial;
  force: MeshLambertMaterial;
  torque: MeshLambertMaterial;
}

function materials(): Materials {
  const one = (): MeshLambertMaterial => new MeshLambertMaterial();
  return { base: one(), plate: one(), spring: one(), force: one(), torque: one() };
}

export class PlatformView {
  private readonly holder: HTMLElement;
  private readonly caption: HTMLElement;
  private readonly materials = materials();
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_DEG, 1, 0.01, 1);
  private readonly platform = new Group();
  private readonly springs: Object3D[] = [];
  private readonly force = new Group();
  private readonly shaft: Mesh;
  private readonly forceTip: Mesh;
  private readonly torque = new Group();
  private arc: Mesh;
  private readonly arcTip: Mesh;
  private arcSteps = -1;
  private renderer: WebGLRenderer | null = null;
  private range_n = 1;
  private range_nm = 0.02;
  private latest: Sample | null = null;
  private visible = false;
  private request = 0;
  private every_ms = 0;
  private drawn_ms = Number.NEGATIVE_INFINITY;

  constructor(parent: HTMLElement) {
    this.caption = make('p', { class: 'platform-caption' }, `movement shown ×${EXAGGERATION}`);
    const label =
      'The platform in three dimensions with arrows of force and torque. Arrow keys turn it, plus and minus zoom, Home resets';
    this.holder = make('div', { class: 'platform', role: 'img', 'aria-label': label });
    parent.append(this.holder, this.caption);
    this.shaft = new Mesh(
      new CylinderGeometry(0.0013, 0.0013, 1, 12).rotateX(Math.PI / 2).translate(0, 0, 0.5),
      this.materials.force,
    );
    this.forceTip = new Mesh(new ConeGeometry(0.0034, 2 * TIP_LENGTH, 16).rotateX(Math.PI / 2), this.materials.force);
    this.arc = new Mesh(new TorusGeometry(ARC_RADIUS, 0.0012, 8, 48), this.materials.torque);
    this.arcTip = new Mesh(new ConeGeometry(0.0026, 0.007, 16), this.materials.torque);
    this.build();
    this.startDrawing();
  }

  /**
   * Full scale, N and N m: the weakest axis' makes two thirds of the longest arrow, which is in the picture
   * from every side.
   */
  setRange(range_n: readonly number[], range_nm: readonly number[]): void {
    this.range_n = Math.min(...range_n) || 1;
    this.range_nm = Math.min(...range_nm) || 0.02;
  }

  show(sample: Sample): void {
    this.latest = sample;
    this.invalidate();
  }

  /** Nothing is measured now. */
  forget(): void {
    this.latest = null;
    this.invalidate();
  }

  private build(): void {
    const { base, plate } = this.materials;
    const foot = new Mesh(new BoxGeometry(0.036, 0.031, 0.004), base);
    foot.position.z = BASE_Z - 0.002;
    const lens = new Mesh(new CylinderGeometry(0.004, 0.0045, 0.004, 24).rotateX(Math.PI / 2), base);
    lens.position.z = BASE_Z + 0.002;
    const top = new Mesh(new BoxGeometry(0.036, 0.031, 0.003), plate);
    const knob = new Mesh(new CylinderGeometry(0.009, 0.0095, 0.004, 48).rotateX(Math.PI / 2), plate);
    knob.position.z = 0.0035;
    this.platform.add(top, knob);
    for (const [x, y] of SPRING_FEET) {
      const coil = spring(this.materials.spring);
      coil.matrixAutoUpdate = false;
      coil.matrix.setPosition(x, y, BASE_Z);
      this.springs.push(coil);
      this.scene.add(coil);
    }
    this.force.add(this.shaft, this.forceTip);
    this.torque.add(this.arc, this.arcTip);
    const light = new DirectionalLight(0xffffff, 2.2);
    light.position.set(-0.4, -0.7, 1);
    this.scene.add(
      foot,
      lens,
      this.platform,
      this.force,
      this.torque,
      new AmbientLight(0xffffff, 1.5),
      light,
      axesTriad(),
    );
    this.place(null);
  }

  private startDrawing(): void {
    const drawing = drawingHere();
    if (drawing === 'none') {
      this.holder.append(
        make(
          'p',
          { class: 'hint' },
          'This browser shows no 3D here (WebGL is off). The numbers say the same.',
        ),
      );
      present(this.caption, false);
      return;
    }
    this.every_ms = drawing === 'software' ? SOFTWARE_EVERY_MS : 0;
    this.renderer = new WebGLRenderer({
      antialias: drawing === 'hardware' || devicePixelRatio < 1.5,
      alpha: true,
      powerPreference: 'low-power',
    });
    const canvas = this.renderer.domElement;
    this.holder.append(canvas);
    new Orbit(this.camera, this.holder, () => this.invalidate());
    onTheme(() => this.recolour());
    new ResizeObserver(() => this.fit()).observe(this.holder);
    new IntersectionObserver((seen) => {
      this.visible = seen.some((entry) => entry.isIntersecting);
      this.invalidate();
    }).observe(this.holder);
    canvas.addEventListener('webglcontextrestored', () => this.invalidate());
  }

  private recolour(): void {
    this.materials.base.color.setStyle(colour('--ink-faint'));
    this.materials.plate.color.setStyle(colour('--plate'));
    this.materials.spring.color.setStyle(colour('--ink-soft'));
    this.materials.force.color.setStyle(colour('--axis-fz'));
    this.materials.torque.color.setStyle(colour('--axis-fx'));
    setTriadColours(
      this.scene,
      AXES.slice(0, 3).map((axis) => colour(axis.colour)),
    );
    this.invalidate();
  }

  private fit(): void {
    const { clientWidth: width, clientHeight: height } = this.holder;
    if (!this.renderer || width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.zoom = Math.min(1, this.camera.aspect);
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  private invalidate(): void {
    if (this.request !== 0 || !this.visible || !this.renderer) return;
    this.request = requestAnimationFrame((now) => {
      this.request = 0;
      if (now - this.drawn_ms < this.every_ms) return this.invalidate();
      this.drawn_ms = now;
      this.place(this.latest);
      this.renderer?.render(this.scene, this.camera);
    });
  }

  private place(sample: Sample | null): void {
    const numbers = sample !== null && carriesNumbers(sample.status) ? sample : null;
    const [x = 0, y = 0, z = 0] = numbers?.d_m ?? [];
    const turn = new Vector3(...(numbers?.d_rad ?? [])).multiplyScalar(EXAGGERATION).clampLength(0, 1.2);
    this.platform.position.set(x, y, z).multiplyScalar(EXAGGERATION).clampLength(0, FARTHEST_MOVE);
    this.platform.quaternion.setFromAxisAngle(
      turn.length() > 1e-9 ? turn.clone().normalize() : UP,
      turn.length(),
    );
    this.platform.updateMatrix();
    for (const [index, coil] of this.springs.entries()) this.stretch(coil, SPRING_FEET[index] ?? [0, 0]);
    this.placeForce(new Vector3(...(numbers?.f_n ?? [])));
    this.placeTorque(new Vector3(...(numbers?.m_nm ?? [])));
    const gone = sample !== null && numbers === null;
    this.holder.classList.toggle('gone', gone);
    say(this.caption, gone ? 'no numbers: platform shown at rest' : this.captionOf(numbers));
  }

  private captionOf(sample: Sample | null): string {
    if (!sample) return `movement shown ×${EXAGGERATION}`;
    const shift = Math.hypot(...sample.d_m) * 1e6;
    const turn = Math.hypot(...sample.d_rad) * 1e3;
    return `movement shown ×${EXAGGERATION}: ${figure(shift, 0).padStart(5, '\u2007')} µm, ${figure(turn, 1).padStart(5, '\u2007')} mrad`;
  }

  /** The coil's own z runs from 0 to 1: sheared so that it ends where the platform holds it. */
  private stretch(coil: Object3D, [x, y]: readonly [number, number]): void {
    const top = new Vector3(x, y, -0.0015).applyMatrix4(this.platform.matrix);
    coil.matrix.set(1, 0, top.x - x, x, 0, 1, top.y - y, y, 0, 0, top.z - BASE_Z, BASE_Z, 0, 0, 0, 1);
    coil.matrixWorldNeedsUpdate = true;
  }

  private placeForce(force: Vector3): void {
    const part = force.length() / this.range_n;
    this.force.visible = part > LEAST_PART;
    if (!this.force.visible) return;
    const { foot, along, length } = forceArrow(force, part, this.platform.matrix);
    this.shaft.scale.set(1, 1, length);
    this.forceTip.position.z = length;
    this.force.quaternion.copy(new Quaternion().setFromUnitVectors(UP, along));
    this.force.position.copy(foot);
  }

  /** An arc round the torque's axis, the longer the stronger. */
  private placeTorque(torque: Vector3): void {
    const part = Math.min(1, torque.length() / this.range_nm);
    this.torque.visible = part > LEAST_PART;
    if (!this.torque.visible) return;
    const steps = Math.max(3, Math.round(part * 48));
    const angle = (steps / 48) * 1.8 * Math.PI;
    if (steps !== this.arcSteps) {
      this.arcSteps = steps;
      this.arc.geometry.dispose();
      this.arc.geometry = new TorusGeometry(ARC_RADIUS, 0.0012, 8, steps, angle);
      this.arcTip.position.set(Math.cos(angle) * ARC_RADIUS, Math.sin(angle) * ARC_RADIUS, 0);
      this.arcTip.rotation.z = angle;
    }
    this.torque.quaternion.copy(new Quaternion().setFromUnitVectors(UP, torque.normalize()));
    this.torque.position.copy(new Vector3(0, 0, ARROW_FOOT).applyMatrix4(this.platform.matrix));
  }
}
