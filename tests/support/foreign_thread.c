/* Stands for a library that starts a thread when it is loaded (OpenBLAS, GPU drivers): preloaded
 * into a program, it has a thread named "foreign" there before main(), which takes every signal and
 * does nothing else. */
#define _GNU_SOURCE
#include <pthread.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

static pthread_barrier_t ready;

static void* idle(void* unused) {
  sigset_t none;
  sigemptyset(&none);
  pthread_sigmask(SIG_SETMASK, &none, NULL);
  prctl(PR_SET_NAME, "foreign");
  pthread_barrier_wait(&ready);
  for (;;) pause();
  return unused;
}

__attribute__((constructor)) static void start(void) {
  pthread_t thread;
  pthread_barrier_init(&ready, NULL, 2);
  if (pthread_create(&thread, NULL, idle, NULL) == 0) pthread_barrier_wait(&ready);
}
