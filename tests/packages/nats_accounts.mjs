// SPDX-License-Identifier: MIT
// Keys, JSON Web Tokens and credentials of NATS, as nsc makes them: an operator, its system account, and one account
// with users.

import { createHash, generateKeyPairSync, sign } from "node:crypto";

const kPrefix = { account: 0, operator: 14 << 3, seed: 18 << 3, user: 20 << 3 };
const kUnlimited = -1;

function base32(bytes) {
  const kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
  const bits = [...bytes].map((byte) => byte.toString(2).padStart(8, "0")).join("");
  return (bits.match(/.{1,5}/g) ?? []).map((five) => kDigits[parseInt(five.padEnd(5, "0"), 2)]).join("");
}

// CRC-16/XMODEM, lower byte first.
function checksum(bytes) {
  let crc = 0;
  for (const byte of bytes) {
    crc ^= byte << 8;
    for (let bit = 0; bit < 8; ++bit) crc = (crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1) & 0xffff;
  }
  return Buffer.from([crc & 0xff, crc >> 8]);
}

function encodeKey(prefix, bytes) {
  const all = Buffer.concat([Buffer.from(prefix), bytes]);
  return base32(Buffer.concat([all, checksum(all)]));
}

// New key of an operator, an account or a user.
function makeKey(kind) {
  const { publicKey, privateKey } = generateKeyPairSync("ed25519");
  const raw = (key, member) => Buffer.from(key.export({ format: "jwk" })[member], "base64url");
  const prefix = kPrefix[kind];
  return {
    id: encodeKey([prefix], raw(publicKey, "x")),
    seed: encodeKey([kPrefix.seed | (prefix >> 5), (prefix & 31) << 3], raw(privateKey, "d")),
    privateKey,
  };
}

function makeToken(issuer, subject, name, nats) {
  const claims = { iat: Math.floor(Date.now() / 1000), iss: issuer.id, name, sub: subject.id, nats: { ...nats, version: 2 } };
  claims.jti = base32(createHash("sha512-256").update(JSON.stringify(claims)).digest());
  const part = (object) => Buffer.from(JSON.stringify(object)).toString("base64url");
  const text = `${part({ typ: "JWT", alg: "ed25519-nkey" })}.${part(claims)}`;
  return `${text}.${sign(null, Buffer.from(text), issuer.privateKey).toString("base64url")}`;
}

// Returns the text of accounts.conf, and that of a file with credentials for each user. `jetStream` has the account's limits
// by the names that tokens have, and `users` the subjects of each user: { publish, subscribe }.
export function makeAccounts(jetStream, users) {
  const [operator, system, fleet] = [makeKey("operator"), makeKey("account"), makeKey("account")];
  const names = ["subs", "data", "payload", "imports", "exports", "conn", "leaf"];
  const limits = { ...Object.fromEntries(names.map((name) => [name, kUnlimited])), wildcards: true };
  const accountToken = (key, name, more) => makeToken(operator, key, name, { type: "account", limits: { ...limits, ...more } });
  const operatorToken = makeToken(operator, operator, "clothstream", { type: "operator", system_account: system.id });
  const configuration = `// Operator "clothstream"
operator: ${operatorToken}

system_account: ${system.id}

resolver: MEMORY

resolver_preload: {
  // Account "SYS"
  ${system.id}: ${accountToken(system, "SYS", {})}

  // Account "clothstream"
  ${fleet.id}: ${accountToken(fleet, "clothstream", jetStream)}

}
`;
  const credentials = Object.entries(users).map(([name, { publish, subscribe }]) => {
    const key = makeKey("user");
    const permissions = { pub: { allow: publish }, sub: { allow: subscribe } };
    const token = makeToken(fleet, key, name, { type: "user", ...permissions, subs: kUnlimited, data: kUnlimited, payload: kUnlimited });
    const text = `-----BEGIN NATS USER JWT-----\n${token}\n------END NATS USER JWT------\n
-----BEGIN USER NKEY SEED-----\n${key.seed}\n------END USER NKEY SEED------\n`;
    return [name, text];
  });
  return { configuration, credentials: Object.fromEntries(credentials) };
}
