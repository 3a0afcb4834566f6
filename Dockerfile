# The demo and the tests in a container of their own:
#   docker build --tag optisense .
#   docker run --rm --volume "$PWD/demo-output:/home/user/optisense/demo-output" optisense
#   docker run --rm optisense make test
FROM debian:trixie-slim

# Python, the two system libraries of the renderer, and those that Blender's module links to.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        ca-certificates make python3 python3-venv libllvm19 libatomic1 \
        libgl1 libegl1 libx11-6 libxext6 libxfixes3 libxi6 libxrender1 libxkbcommon0 libsm6 libice6 \
    && rm -rf /var/lib/apt/lists/*

RUN useradd --create-home user
USER user
WORKDIR /home/user/optisense
COPY --chown=user . .
RUN make setup setup-blender

CMD ["make", "demo"]
