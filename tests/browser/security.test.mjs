// What strangers send to the bridge's server, and what becomes of it: raw sockets against the server alone, with a made-up
// sensor behind it (tests/unit/web/server_program.cpp). No browser.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, symlinkSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { dirname, join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { program, reason, scratch } from './support/environment.mjs';
import { BINARY, PING, TEXT, WsPage, WsRefused, frame, rawExchange } from './support/ws.mjs';

const server = process.env.TAGWRENCH_WEB_SERVER ?? join(dirname(program), '../tests/unit/web/web_server_program');
const skip = reason() || (!existsSync(server) && `the server's test program is not built (${server})`);
const TOKEN = 'a-token-of-43-letters-0123456789-0123456789';
const LOGGED = /tagwrench: web: refused: /;

/** The server with a folder of pages; `log()` is what it has told so far. */
class Server {
  static async start(...args) {
    const self = new Server();
    const folder = scratch('security');
    self.folder = folder;
    for (const name of ['pages/dashboard/assets', 'pages/sensor', 'recordings']) mkdirSync(join(folder, name), { recursive: true });
    writeFileSync(join(folder, 'pages/dashboard/index.html'), '<!doctype html><title>dashboard</title>');
    writeFileSync(join(folder, 'pages/dashboard/assets/index-1.js'), 'x'.repeat(3_000_000));
    writeFileSync(join(folder, 'recordings/push.twr'), 'a recording');
    writeFileSync(join(folder, 'secret.txt'), 'a secret');
    symlinkSync(join(folder, 'secret.txt'), join(folder, 'recordings/link.twr'));
    const places = ['--pages', join(folder, 'pages'), '--files', join(folder, 'recordings')];
    self.child = spawn(server, [...places, ...args], { stdio: ['pipe', 'pipe', 'pipe'] });
    self.ended = new Promise((resolve) => self.child.on('exit', resolve));
    self.text = '';
    self.child.stderr.on('data', (part) => (self.text += part));
    self.port = Number(await new Promise((resolve) => self.child.stdout.once('data', (line) => resolve(`${line}`))));
    return self;
  }

  get host() {
    return `127.0.0.1:${this.port}`;
  }

  page(options) {
    return WsPage.connect(this.port, options);
  }

  /** The whole answer to a request line with these headers; the connection is closed after it. */
  get(target, headers = [`Host: ${this.host}`], method = 'GET') {
    return rawExchange(this.port, `${[`${method} ${target} HTTP/1.1`, ...headers, 'Connection: close'].join('\r\n')}\r\n\r\n`);
  }

  async stop() {
    this.child.stdin.end();
    assert.equal(await this.ended, 0);
  }
}

const status = (answer) => Number(answer.split(' ', 2)[1]);
/** 'open' (and gone again), or the status of what refused it. */
const opened = (promise) =>
  promise.then((page) => (page.destroy(), 'open'), (error) => (error instanceof WsRefused ? error.status : error));
const connection = (port) =>
  new Promise((resolve, reject) => {
    const socket = net.connect(port, '127.0.0.1', () => resolve(socket));
    socket.on('error', reject);
    socket.heard = '';
    socket.on('data', (part) => (socket.heard += part));
    socket.ended = new Promise((done) => socket.on('close', done));
  });
const closedAs = async (page, send) => {
  send(page);
  return (await page.closed).code;
};

describe('requests', { skip }, () => {
  let web;
  before(async () => (web = await Server.start()));
  after(() => web.stop());

  test('a page is served with headers that keep it to itself', async () => {
    const answer = await web.get('/');
    assert.equal(status(answer), 200);
    assert.match(answer, /content-security-policy: default-src 'none'; script-src 'self';/i);
    assert.match(answer, /x-content-type-options: nosniff/i);
    assert.match(answer, /referrer-policy: no-referrer/i);
    assert.doesNotMatch(answer, /^server:|access-control-allow-origin/im);
  });

  test('a name that was made to point here is refused, logged once, and told nothing', async () => {
    for (let i = 0; i < 5; ++i) {
      const answer = await web.get('/', ['Host: evil.example']);
      assert.equal(status(answer), 403);
      assert.doesNotMatch(answer, /dashboard/);
    }
    assert.equal(status(await web.get('/', [])), 403);
    assert.equal(web.text.split('\n').filter((line) => LOGGED.test(line) && line.includes('evil.example')).length, 1);
  });

  test('no path leaves the folders', async () => {
    const paths = ['/../secret.txt', '/..%2fsecret.txt', '/%2e%2e/secret.txt', '/%2e%2e%2fsecret.txt', '/..\\secret.txt'];
    const more = ['/..%5csecret.txt', '//secret.txt', '/assets/../../secret.txt', '/secret.txt%00.js', '/%252e%252e/secret.txt'];
    const files = ['/files/recordings/../../secret.txt', '/files/recordings/%2e%2e/secret.txt', '/files/recordings/link.twr'];
    const absolute = [join(web.folder, 'secret.txt'), `http://${web.host}/secret.txt`, 'file:///etc/passwd', '/.git/config'];
    for (const path of [...paths, ...more, ...files, ...absolute]) {
      const answer = await web.get(path);
      assert.ok([400, 404].includes(status(answer)), `${path}: ${answer.split('\r\n', 1)}`);
      assert.doesNotMatch(answer, /a secret|root:|tagwrench-security/, path);
    }
    assert.match(await web.get('/files/recordings/push.twr'), /\r\n\r\na recording$/);
  });

  test('files are not for pages of other sites', async () => {
    const target = '/files/recordings/push.twr';
    const host = `Host: ${web.host}`;
    assert.equal(status(await web.get(target, [host, 'Origin: http://evil.example'])), 403);
    assert.equal(status(await web.get(target, [host, 'Sec-Fetch-Site: cross-site'])), 403);
    assert.equal(status(await web.get(target, [host, 'Sec-Fetch-Site: same-origin'])), 200);
  });

  test('only GET and HEAD, and no bodies', async () => {
    for (const method of ['POST', 'PUT', 'DELETE', 'OPTIONS', 'TRACE', 'NONSENSE'])
      assert.equal(status(await web.get('/', undefined, method)), 405, method);
    const head = await web.get('/', undefined, 'HEAD');
    assert.match(head, /content-length: 39\r\n\r\n$/i);
    const body = await web.get('/', [`Host: ${web.host}`, 'Content-Length: 5']);
    assert.ok([400, 413].includes(status(body)), body);
  });

  test('what is no request, or too long, is answered in a line', async () => {
    assert.equal(status(await rawExchange(web.port, '\x16\x03\x01 this is TLS\r\n\r\n', { half: false })), 400);
    assert.equal(status(await rawExchange(web.port, 'GET / HTTP/9.9\r\n\r\n', { half: false })), 400);
    assert.equal(status(await web.get('/', [`Host: ${web.host}`, `X-Long: ${'a'.repeat(9000)}`])), 431);
    assert.equal(status(await web.get(`/${'a'.repeat(9000)}`)), 431);
    assert.equal(status(await web.get('/', Array.from({ length: 900 }, (_, i) => `X-${i}: ${'b'.repeat(10)}`))), 431);
  });

  test('requests that come together are answered one after another', async () => {
    const one = `GET / HTTP/1.1\r\nHost: ${web.host}\r\n\r\n`;
    const last = one.replace('\r\n\r\n', '\r\nConnection: close\r\n\r\n');
    const answer = await rawExchange(web.port, one + one + last);
    assert.equal(answer.split('<title>dashboard').length - 1, 3);
  });

  test('a large file arrives whole', async () => {
    const answer = await web.get('/assets/index-1.js');
    assert.equal(answer.length - answer.indexOf('\r\n\r\n') - 4, 3_000_000);
  });
});

describe('sockets', { skip }, () => {
  let web;
  before(async () => (web = await Server.start()));
  after(() => web.stop());

  test('the own page gets hello, samples and answers', async () => {
    const page = await web.page();
    assert.equal(page.protocol, 'tagwrench.v1');
    assert.equal((await page.next()).type, 'hello');
    const { samples } = await page.next((message) => message.type === 'samples');
    assert.equal(samples[0].f_n.length, 3);
    assert.deepEqual((await page.ask('echo', { a: [1] })).data.a, [1]);
    assert.equal((await page.ask('fail')).text, 'it fails');
    page.close();
    assert.equal((await page.closed).code, 1000);
  });

  test('pages of other sites, other names and other protocols are refused', async () => {
    assert.equal(await opened(web.page({ origin: 'http://evil.example' })), 403);
    assert.equal(await opened(web.page({ origin: null })), 403);
    assert.equal(await opened(web.page({ origin: 'null' })), 403);
    assert.equal(await opened(web.page({ origin: `https://${web.host}` })), 403);
    assert.equal(await opened(web.page({ host: 'evil.example', origin: 'http://evil.example' })), 403);
    assert.equal(await opened(web.page({ protocols: ['tagwrench.v2'] })), 400);
    assert.equal(await opened(web.page({ protocols: [] })), 400);
    assert.equal(await opened(web.page({ host: `localhost:${web.port}` })), 'open');
    assert.match(web.text, /refused: .*evil\.example/);
    assert.equal(status(await web.get('/ws', [`Host: ${web.host}`, `Origin: http://${web.host}`])), 400);
  });

  test('a message that breaks a rule closes its page, and says which', async () => {
    const giant = JSON.stringify({ id: 1, ask: 'echo', text: 'x'.repeat(20_000) });
    const half = Buffer.alloc(15_000, 120);
    const cases = [
      ['giant', 1009, (page) => page.send(giant)],
      ['giant in fragments', 1009, (page) => (page.sendFrame(TEXT, half, { final: false }), page.sendFrame(0, half))],
      ['said to be giant', 1009, (page) => page.sendBytes(Buffer.from([0x81, 0xff, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2, 3, 4]))],
      ['binary', 1003, (page) => page.sendFrame(BINARY, 'abc')],
      ['not UTF-8', 1007, (page) => page.sendFrame(TEXT, Buffer.from([0x22, 0xc3, 0x28, 0x22]))],
      ['not masked', 1002, (page) => page.sendFrame(TEXT, '{}', { masked: false })],
      ['compressed, which nobody agreed to', 1002, (page) => page.sendFrame(TEXT, '{}', { reserved: 4 })],
      ['unknown kind of frame', 1002, (page) => page.sendFrame(5, '{}')],
      ['ping in fragments', 1002, (page) => page.sendFrame(PING, 'x', { final: false })],
      ['not JSON', 1008, (page) => page.send('zero')],
      ['nobody to answer', 1008, (page) => page.send({ ask: 'zero' })],
      ['deep', 1008, (page) => page.send('['.repeat(19_000))],
    ];
    const other = await web.page();
    for (const [name, code, send] of cases) assert.equal(await closedAs(await web.page(), send), code, name);
    assert.ok((await other.ask('echo')).ok);
    other.destroy();
  });

  test('fragments make one message, with pings between them', async () => {
    const page = await web.page();
    page.sendFrame(TEXT, '{"id":5,"ask":"ec', { final: false });
    page.sendFrame(PING, 'x');
    page.sendFrame(0, 'ho"}');
    assert.ok((await page.next((message) => message.id === 5)).ok);
    page.destroy();
  });

  test('wrong requests are answered, each once', async () => {
    const page = await web.page();
    for (const ask of ['', 'Zero', 'a b', 7, null]) {
      page.send({ id: 9, ask });
      assert.equal((await page.next((message) => message.id === 9)).ok, false);
    }
    assert.equal((await page.ask('pictures', { on: 'yes' })).ok, false);
    page.destroy();
  });

  test('too many messages close their page, pings too', async () => {
    const many = (send) => (page) => Array.from({ length: 60 }, () => send(page));
    assert.equal(await closedAs(await web.page(), many((page) => page.send({ id: 1, ask: 'quiet' }))), 1008);
    assert.equal(await closedAs(await web.page(), many((page) => page.sendFrame(PING, 'x'))), 1006);
  });

  test('pictures come to those who want them', async () => {
    const [wants, other] = [await web.page(), await web.page()];
    await wants.ask('pictures', { on: true });
    await wants.next((message) => message.type === 'picture');
    assert.equal(wants.picture.header.width, 640);
    assert.deepEqual([...wants.picture.jpeg.subarray(0, 3)], [0xff, 0xd8, 0xff]);
    await wants.ask('pictures', { on: false });
    assert.equal(other.pictures, 0);
    wants.destroy();
    other.destroy();
  });
});

describe('crowds', { skip }, () => {
  let web;
  before(async () => (web = await Server.start('--hurry', '10')));
  after(() => web.stop());

  test('a thousand connections leave the open pages alone, and memory bounded', async () => {
    const page = await web.page();
    const before = (await page.ask('memory')).data.resident_kb;
    const crowd = await Promise.all(Array.from({ length: 1000 }, () => connection(web.port)));
    await page.nextNew((message) => message.type === 'samples');
    const { data } = await page.ask('memory');
    assert.ok(data.resident_kb - before < 8192, `${data.resident_kb - before} kB more`);
    await Promise.all(crowd.map((socket) => socket.ended));
    assert.ok((await page.ask('echo')).ok);
    assert.match(web.text, /refused: Too many/);
    assert.equal(status(await web.get('/')), 200);
    page.destroy();
  });

  test('connections that never finish a request make room for one that does', async () => {
    const half = [];
    for (let i = 0; i < 70; i++) {
      half.push(await connection(web.port));
      half[i].write('GET / HTTP/1.1\r\nHost:');
    }
    assert.equal(status(await web.get('/')), 200);
    await half[0].ended; // the oldest has made room
    assert.equal(half[0].heard, '');
    assert.equal(await opened(web.page()), 'open');
    for (const socket of half) socket.destroy();
  });

  test('the 17th page is refused, and comes in when another has gone', async () => {
    const pages = await Promise.all(Array.from({ length: 16 }, () => web.page()));
    assert.equal(await opened(web.page()), 503);
    pages[0].close();
    await pages[0].closed;
    let how = 503;
    while (how === 503) how = await opened(web.page()); // until the bridge has noticed
    assert.equal(how, 'open');
    for (const page of pages) page.destroy();
  });

  // A browser connects before it has anything to ask.
  test('a connection that says a little at a time is closed, later one that says nothing', async (t) => {
    const unhurried = await Server.start('--hurry', '2');
    t.after(() => unhurried.stop());
    const asks = await connection(unhurried.port);
    const slow = await connection(unhurried.port); // later than the other, and yet gone before it
    const dribble = setInterval(() => slow.write('a'), 50);
    slow.on('error', () => {});
    await slow.ended;
    clearInterval(dribble);
    asks.write(`GET / HTTP/1.1\r\nHost: ${unhurried.host}\r\nConnection: close\r\n\r\n`);
    await asks.ended;
    assert.equal(status(asks.heard), 200);
    const silent = await connection(unhurried.port);
    await silent.ended;
    assert.equal(silent.heard, '');
  });

  test('a page that does not answer pings is let go', async () => {
    const page = await web.page();
    page.answersPings = false;
    assert.equal((await page.closed).code, 1006);
  });

  test('a page that never reads costs nobody anything', async () => {
    const reader = await web.page();
    const deaf = await web.page();
    await deaf.ask('pictures', { on: true });
    deaf.stopReading();
    const { data: before } = await reader.ask('memory');
    assert.equal(before.pages, 2);
    for (let pages = 2; pages > 1; pages = (await reader.ask('memory')).data.pages) {
      for (let i = 0; i < 20; ++i) await reader.nextNew((message) => message.type === 'samples');
      await reader.ask('say', { lines: 20 });
      reader.messages.length = 0;
    }
    const { data: after } = await reader.ask('memory');
    assert.ok(after.resident_kb - before.resident_kb < 8192, `${after.resident_kb - before.resident_kb} kB more`);
    assert.ok(after.rate_hz > 0);
    reader.destroy();
    deaf.destroy();
  });

  test('more lines than a page can be sent at once close it, not the bridge', async () => {
    const page = await web.page();
    page.send({ id: 1, ask: 'say', lines: 5000 });
    assert.equal((await page.closed).code, 1013);
    const next = await web.page();
    assert.ok((await next.ask('echo')).ok);
    next.destroy();
  });
});

describe('a token', { skip }, () => {
  let web;
  before(async () => (web = await Server.start('--token', TOKEN)));
  after(() => web.stop());

  test('is needed for the socket and for files, but not for the page that asks for it', async () => {
    assert.equal(status(await web.get('/')), 200);
    assert.equal(status(await web.get('/', ['Host: sensor.lab.example:8137'])), 200);
    const host = 'sensor.lab.example:8137'; // a name may be anybody's: who asks is not asked then
    const push = '/files/recordings/push.twr';
    assert.equal(status(await web.get(push, [`Host: ${host}`])), 401);
    assert.equal(await opened(web.page({ host })), 401);
    assert.equal(await opened(web.page({ host, token: TOKEN.replace('a', 'b') })), 401);
    assert.equal(await opened(web.page({ host, token: '' })), 401);
    assert.equal(status(await web.get(`/ws?token=${TOKEN}`)), 404);
    assert.equal(status(await web.get(`${push}?token=${TOKEN}`, [`Host: ${host}`])), 401);
    assert.equal(await opened(web.page({ token: TOKEN, origin: 'http://evil.example' })), 403);
  });

  test('is not needed by who runs the bridge, on this computer', async () => {
    assert.equal(await opened(web.page()), 'open');
    assert.equal(await opened(web.page({ host: `localhost:${web.port}` })), 'open');
    assert.match(await web.get('/files/recordings/push.twr'), /a recording$/);
  });

  test('lets in whoever has it, by any name of the computer', async () => {
    assert.equal(await opened(web.page({ token: TOKEN })), 'open');
    assert.equal(await opened(web.page({ token: TOKEN, host: 'sensor.lab.example:8137' })), 'open');
    const bearer = [`Host: ${web.host}`, `Authorization: Bearer ${TOKEN}`];
    assert.match(await web.get('/files/recordings/push.twr', bearer), /a recording$/);
  });

  test('is never told, and goodbye is said to pages at the end', async () => {
    const page = await web.page({ token: TOKEN });
    for (const target of ['/ws', '/', '/missing', '/files/x']) assert.doesNotMatch(await web.get(target), new RegExp(TOKEN));
    assert.match(web.text, LOGGED);
    assert.doesNotMatch(web.text, new RegExp(TOKEN));
    assert.doesNotMatch(web.text, new RegExp(Buffer.from(TOKEN).toString('base64url')));
    web.child.stdin.end();
    assert.equal((await page.closed).code, 1001);
  });
});
