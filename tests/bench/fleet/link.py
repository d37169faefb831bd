# SPDX-License-Identifier: MIT
"""A TCP proxy that delays what it forwards, as a network would: `link.py FROM TO MILLISECONDS`, with addresses such as
127.0.0.2:25221. The delay is that of each direction. A connection begins after two delays, like the handshake of TCP.
"""
import asyncio
import sys

CHUNK = 64 * 1024


async def forward(reader, writer, delay):
    loop = asyncio.get_running_loop()
    waiting = asyncio.Queue()

    async def send():
        while data := await take():
            writer.write(data)
        writer.close()

    async def take():
        due, data = await waiting.get()
        await asyncio.sleep(due - loop.time())
        return data

    sending = asyncio.create_task(send())
    try:
        while data := await reader.read(CHUNK):
            waiting.put_nowait((loop.time() + delay, data))
    except ConnectionError:
        pass  # the other side ends, too
    waiting.put_nowait((loop.time() + delay, b""))
    await sending


async def main(listen, target, delay):
    async def connect(reader, writer):
        await asyncio.sleep(2 * delay)
        try:
            far_reader, far_writer = await asyncio.open_connection(*target)
        except ConnectionError:
            return writer.close()
        await asyncio.gather(forward(reader, far_writer, delay), forward(far_reader, writer, delay))

    async with await asyncio.start_server(connect, *listen) as server:
        print("forwards", flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    addresses = [(host, int(port)) for host, _, port in (argument.rpartition(":") for argument in sys.argv[1:3])]
    asyncio.run(main(*addresses, float(sys.argv[3]) / 1000))
