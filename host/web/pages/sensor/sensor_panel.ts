// Which sensor is in force: its files loaded, dropped, changed a little, saved.
import { button, field, make, panel, present, say } from '../common/elements';
import type { SensorInfo } from './core';
import { download } from '../common/download';
import type { SensorFiles } from './messages';
import { withFiles } from './sensor_files';
import { FAMILIES, type SensorKeys, readKeys, stillMeasured, writeKeys } from './sensor_keys';

export interface SensorPanelOptions {
  /** Puts it in force, or throws an Error with one line. */
  onFiles: (files: SensorFiles) => Promise<void>;
  onExample: () => Promise<void>;
  /** What was learned at rest, as files of measured/. */
  learned: () => Promise<Record<string, string>>;
}

export class SensorPanel {
  private readonly words = make('p');
  private readonly trouble = make('p', { class: 'error', role: 'alert', hidden: true });
  private readonly chooser = make('input', { type: 'file', multiple: true, accept: '.yaml,.yml,.json,.png,.rest', class: 'unseen', tabindex: -1, 'aria-hidden': 'true' });
  private readonly form = make('form', { class: 'fields' });
  private files: SensorFiles | null = null;
  private shown = (): void => {};
  /** The first sensor is in force: what people choose before that waits. */
  private readonly first = new Promise<void>((done) => {
    this.shown = done;
  });

  constructor(parent: HTMLElement, private readonly options: SensorPanelOptions) {
    const load = button('Load files', () => this.chooser.click(), { title: 'sensor.yaml, the files of its folder measured/, or both; dropping them on the page does too' });
    const save = button('Save sensor.yaml', () => void this.save(), {
      title: 'And the files of its folder measured/: the rest pose and the tags\' places among them, once they are learned',
    });
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
    await this.attempt(() => this.options.onFiles(SensorPanel.changed(files, before, { ...before, mirrored })));
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
      const { files } = this;
      if (!files) return;
      const learned = await this.options.learned();
      const save = (name: string, content: BlobPart): void => download(name, new Blob([content]));
      save('sensor.yaml', files.yaml);
      if (files.calibration) save('calibration.json', files.calibration);
      for (const [name, text] of Object.entries(learned)) save(name, text);
      for (const [name, bytes] of Object.entries(files.measured ?? {})) {
        if (!(name in learned)) save(name, bytes.slice());
      }
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
    await this.attempt(() => this.options.onFiles(SensorPanel.changed(files, readKeys(files.yaml), now)));
  }

  private static changed(files: SensorFiles, before: SensorKeys, now: SensorKeys): SensorFiles {
    const measured = stillMeasured(files.measured ?? {}, before, now);
    return { ...files, yaml: writeKeys(files.yaml, before, now), measured };
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
