// Parts of the platform's picture that are a matter of geometry alone.
import {
  ArrowHelper,
  CanvasTexture,
  Color,
  Curve,
  Group,
  type Material,
  Mesh,
  type Object3D,
  Sprite,
  SpriteMaterial,
  TubeGeometry,
  Vector3,
} from 'three';

const TURNS = 5;
const COIL_RADIUS = 0.0028;
const COIL_HEIGHT = 0.02;
const TRIAD_AT = new Vector3(-0.026, -0.022, -0.024);
const TRIAD_LENGTH = 0.013;

/** As high as a spring is, so that its wire is round. */
class Helix extends Curve<Vector3> {
  constructor() {
    super();
  }

  override getPoint(part: number, target = new Vector3()): Vector3 {
    const angle = part * TURNS * 2 * Math.PI;
    return target.set(Math.cos(angle) * COIL_RADIUS, Math.sin(angle) * COIL_RADIUS, part * COIL_HEIGHT);
  }
}

/** From z = 0 to z = 1; whoever places it scales it back. */
export function spring(material: Material): Object3D {
  return new Mesh(new TubeGeometry(new Helix(), 110, 0.0005, 6).scale(1, 1, 1 / COIL_HEIGHT), material);
}

const NAMES = ['x', 'y', 'z'] as const;

function letter(name: string): Sprite {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const context = canvas.getContext('2d');
  if (context) {
    context.font = '48px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillStyle = '#ffffff';
    context.fillText(name, 32, 32);
  }
  const sprite = new Sprite(new SpriteMaterial({ map: new CanvasTexture(canvas), depthTest: false }));
  sprite.scale.setScalar(0.008);
  return sprite;
}

/** Small axes beside the platform. */
export function axesTriad(): Group {
  const triad = new Group();
  triad.name = 'triad';
  for (const [index, name] of NAMES.entries()) {
    const along = new Vector3().setComponent(index, 1);
    const arrow = new ArrowHelper(along, new Vector3(), TRIAD_LENGTH, 0xffffff, 0.004, 0.0025);
    const label = letter(name);
    label.position.copy(along).multiplyScalar(TRIAD_LENGTH + 0.004);
    triad.add(arrow, label);
  }
  triad.position.copy(TRIAD_AT);
  return triad;
}

export function setTriadColours(scene: Object3D, colours: readonly string[]): void {
  for (const [index, part] of (scene.getObjectByName('triad')?.children ?? []).entries()) {
    const colour = new Color(colours[index >> 1] ?? '#888888');
    if (part instanceof ArrowHelper) part.setColor(colour);
    if (part instanceof Sprite) part.material.color.copy(colour);
  }
}
