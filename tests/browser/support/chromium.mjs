// Real headless Chromium for the tests of the pages.
//
//   const browser = await openChromium({ clip: '/abs/clip.y4m' });   the clip is the camera; it loops for ever, frame by frame
//   const browser = await openChromium({ camera: true });            Chromium's own moving picture as camera (it has exposure
//                                                                    and focus to set, which a clip has not)
//   const browser = await openChromium();                            no camera
//   options: ask: true      nobody answers the browser's question for the camera (otherwise: yes)
//            hosts: {'sensor.test': '127.0.0.1'}   names that lead here
//   const { page, faults, foreign } = await openPage(browser, url, { colorScheme, viewport, ...context options of playwright });
//     faults    what went wrong in the page, as it goes: exceptions, console errors, broken requests
//     foreign   addresses beyond the page's own host that were asked for (must stay empty)
//   await shoot(page, 'sensor-live-dark-phone')      a picture into the folder of screenshots
//   kViews    desktop and phone, light and dark: {name, options for openPage}
import { chromiumPath, nodePackage, screenshotPath } from './environment.mjs';

// Chromium loses a frame of its own when a track ends before the worker reads the stream that it was handed, as on a busy machine.
// A page that keeps the frames that it has measured stands still, for the camera has no more of them; that those left out are closed,
// sensor_newest.test.mjs sees.
const kFrameOnItsWay = /^A VideoFrame was garbage collected without being closed/;

const kPatience_ms = 120_000; // of a busy machine; nothing is judged by time

const kArguments = [
  '--no-sandbox',
  '--disable-gpu',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--disable-dev-shm-usage',
];

export async function openChromium({ clip, camera = false, ask = false, hosts = {}, args = [] } = {}) {
  const all = [...kArguments, ...args];
  if (clip || camera) all.push(camera === true || clip ? '--use-fake-device-for-media-stream' : `--use-fake-device-for-media-stream=${camera}`);
  if (clip) all.push(`--use-file-for-fake-video-capture=${clip}`);
  if (!ask) all.push('--use-fake-ui-for-media-stream');
  const rules = Object.entries(hosts).map(([name, address]) => `MAP ${name} ${address}`);
  if (rules.length) all.push(`--host-resolver-rules=${rules.join(',')}`);
  return nodePackage('playwright-core').chromium.launch({ executablePath: chromiumPath, headless: true, args: all, timeout: kPatience_ms });
}

export async function openPage(browser, url, { init, ...options } = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, ...options });
  context.setDefaultTimeout(kPatience_ms);
  const page = await context.newPage();
  const faults = [];
  const foreign = [];
  page.on('pageerror', (error) => faults.push(`exception: ${error.message}`));
  page.on('console', (message) => {
    if (message.type() === 'error' && !kFrameOnItsWay.test(message.text())) faults.push(`console: ${message.text()} (${message.location().url})`);
  });
  context.on('request', (request) => {
    const asked = new URL(request.url());
    const own = new URL(url);
    if (/^(https?|wss?):$/.test(asked.protocol) && asked.host !== own.host) foreign.push(request.url());
  });
  if (init) await page.addInitScript(init);
  await page.goto(url);
  return { page, context, faults, foreign };
}

export async function shoot(page, name, { whole = false } = {}) {
  const path = screenshotPath(name);
  await page.screenshot({ path, fullPage: whole });
  return path;
}

const kDesktop = { viewport: { width: 1280, height: 800 } };
const kPhone = { viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true };
export const kViews = [
  { name: 'light-desktop', options: { ...kDesktop, colorScheme: 'light' } },
  { name: 'dark-desktop', options: { ...kDesktop, colorScheme: 'dark' } },
  { name: 'light-phone', options: { ...kPhone, colorScheme: 'light' } },
  { name: 'dark-phone', options: { ...kPhone, colorScheme: 'dark' } },
];
