// The whole sensor in a tab: either it can run here, or the page says what to do.
import '../common/theme.css';
import './sensor.css';
import { make } from '../common/elements';
import { themeSwitch } from '../common/theme';
import { firstTrouble } from './checks';
import { Instrument } from './instrument';
import { keepOffline } from './offline';

/** Fills the header, which has its room from the start; gives where it is said what is kept. */
function header(): HTMLElement {
  const kept = make('span', { class: 'hint', role: 'status' });
  const about = make('span', { class: 'hint about' }, 'the sensor in this tab');
  document.querySelector('.top')?.append(make('h1', {}, 'tagwrench'), about, kept, themeSwitch());
  return kept;
}

const root = document.getElementById('sensor') ?? document.body;
root.replaceChildren();
const kept = header();
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
