// The whole sensor in a tab: either it can run here, or the page says what to do.
import '../common/theme.css';
import './sensor.css';
import { make } from '../common/elements';
import { themeSwitch } from '../common/theme';
import { firstTrouble } from './checks';
import { Instrument } from './instrument';
import { keepOffline } from './offline';

function header(): { bar: HTMLElement; kept: HTMLElement } {
  const kept = make('span', { class: 'hint', role: 'status' });
  const bar = make(
    'header', { class: 'top' },
    make('h1', {}, 'tagwrench'), make('span', { class: 'hint' }, 'the sensor in this tab'), kept, themeSwitch(),
  );
  return { bar, kept };
}

const root = document.getElementById('sensor') ?? document.body;
root.replaceChildren();
const { bar, kept } = header();
document.body.prepend(bar);
const trouble = firstTrouble();
if (trouble) {
  root.append(make(
    'section', { class: 'panel stop', role: 'alert' },
    make('h2', {}, trouble.title), make('p', {}, trouble.advice),
  ));
} else {
  void new Instrument(root).begin();
  void keepOffline((state) => {
    kept.textContent = state === 'kept' ? 'kept: works without a network' : 'a newer version is here: reload the page';
  });
}
