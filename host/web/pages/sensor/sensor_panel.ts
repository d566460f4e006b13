// Which sensor is in force: its files loaded, dropped, changed a little, saved.
import { button, field, make, panel, present, say } from '../common/elements';
import type { SensorInfo } from './core';
import { download } from '../common/download';
import type { SensorFiles } from './messages';
import { FAMILIES, type SensorKeys, readKeys, writeKeys } from './sensor_edit';
import { withFiles } from './sensor_files';

export interface SensorPanelOptions {
  /** Puts it in force, or throws an Error with one line. */
  onFiles: (files: SensorFiles) => Promise<void>;
  onExample: () => Promise<void>;
  /** sensor.yaml with what was learned at rest. */
  learned: () => Promise<string>;
}

export class SensorPanel {
  private readonly words = make('p');
  private readonly trouble = make('p', { class: 'error', role: 'alert', hidden: true });
  private readonly chooser = make('input', { type: 'file', multiple: true, accept: '.yaml,.yml,.json,.png', class: 'unseen', tabindex: -1, 'aria-hidden': 'true' });
  private readonly form = make('form', { class: 'fields' });
  private files: SensorFiles | null = null;
  private shown = (): void => {};
  /** The first sensor is in force: what people choose before that waits. */
  private readonly first = new Promise<void>((done) => {
    this.shown = done;
  });

  constructor(parent: HTMLElement, private readonly options: SensorPanelOptions) {
    const load = button('Load files', () => this.chooser.click(), { title: 'sensor.yaml, calibration.json, or both; dropping them on the page does too' });
    const save = button('Save sensor.yaml', () => void this.save(), { title: 'With the rest pose and the tags\' places, once they are learned' });
    const example = button('Published sensor', () => void this.attempt(options.onExample), { title: 'The example that is built in' });
    const edit = make('details', {}, make('summary', {}, 'Change tags, focal length, mirroring'), this.form);
    this.chooser.addEventListener('change', () => {
      void this.take([...(this.chooser.files ?? [])]);
      this.chooser.value = '';
    });
    this.form.addEventListener('submit', (event) => {
      event.preventDefault();
      void this.change();
    });
    parent.append(panel(
      'Sensor', 'sensor-panel', this.words, this.trouble,
      make('div', { class: 'row' }, load, save, example), this.chooser, edit,
    ));
    this.acceptDrops();
  }

  show(files: SensorFiles, info: SensorInfo): void {
    this.files = files;
    present(this.trouble, false);
    say(this.words, `${files.name}: ${info.words}`);
    this.fill(readKeys(files.yaml));
    this.shown();
  }

  async take(files: readonly File[]): Promise<void> {
    if (files.length === 0) return;
    await this.first;
    await this.attempt(async () => {
      if (this.files) await this.options.onFiles(await withFiles(this.files, files));
    });
  }

  /** As if the box of the form were ticked. */
  async setMirrored(mirrored: boolean): Promise<void> {
    const { files } = this;
    if (!files) return;
    const before = readKeys(files.yaml);
    await this.attempt(() => this.options.onFiles({ ...files, yaml: writeKeys(files.yaml, before, { ...before, mirrored }) }));
  }

  private async attempt(what: () => Promise<void>): Promise<void> {
    try {
      await what();
    } catch (error) {
      const line = error instanceof Error ? error.message : String(error);
      const kept = this.files ? ` (${this.files.name} stays in force)` : '';
      say(this.trouble, line + kept);
      present(this.trouble, true);
    }
  }

  private async save(): Promise<void> {
    await this.attempt(async () => {
      download('sensor.yaml', new Blob([await this.options.learned()], { type: 'text/yaml' }));
      const { files } = this;
      if (files?.calibration) download('calibration.json', new Blob([files.calibration], { type: 'application/json' }));
    });
  }

  private fill(keys: SensorKeys): void {
    const number = (name: string, value: number, step: string): HTMLInputElement =>
      make('input', { name, type: 'number', min: 0, step, value, required: true });
    const family = make('select', { name: 'family' });
    const names = FAMILIES.includes(keys.family) ? FAMILIES : [keys.family, ...FAMILIES];
    family.append(...names.map((name) => make('option', { value: name, selected: name === keys.family }, name)));
    this.form.replaceChildren(
      field('Tag family', family),
      field('Tag ids', make('input', { name: 'ids', value: keys.ids, pattern: '[0-9 ,;]+', required: true })),
      field('Tag size, mm', number('tag_size_mm', keys.tag_size_mm, 'any'), 'edge of the black square, as printed'),
      field('Focal length, px', number('focal_px', keys.focal_px, 'any')),
      field('Width, px', number('width', keys.width, '1')),
      field('Height, px', number('height', keys.height, '1')),
      field('Mirrored', make('input', { name: 'mirrored', type: 'checkbox', checked: keys.mirrored }), 'the camera delivers its picture flipped left to right'),
      make('div', { class: 'row' }, make('button', { type: 'submit' }, 'Use these')),
    );
  }

  private async change(): Promise<void> {
    const { files } = this;
    if (!files) return;
    const said = new FormData(this.form);
    const text = (name: string): string => String(said.get(name) ?? '');
    const now: SensorKeys = {
      family: text('family'), ids: text('ids'), tag_size_mm: Number(text('tag_size_mm')), focal_px: Number(text('focal_px')),
      width: Number(text('width')), height: Number(text('height')), mirrored: said.has('mirrored'),
    };
    await this.attempt(() => this.options.onFiles({ ...files, yaml: writeKeys(files.yaml, readKeys(files.yaml), now) }));
  }

  private acceptDrops(): void {
    const over = (on: boolean): void => void document.documentElement.classList.toggle('dropping', on);
    document.addEventListener('dragover', (event) => {
      event.preventDefault();
      over(true);
    });
    document.addEventListener('dragleave', (event) => {
      if (!event.relatedTarget) over(false);
    });
    document.addEventListener('drop', (event) => {
      event.preventDefault();
      over(false);
      void this.take([...(event.dataTransfer?.files ?? [])]);
    });
  }
}
