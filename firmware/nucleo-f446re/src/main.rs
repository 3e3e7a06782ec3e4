//! A controller with the ports alpha and beta on the board Nucleo-F446RE, sampled by a timer, with its link on the serial port of the
//! board's USB connector. Compiled, never run: docs/firmware.md says what to adapt.
//!
//! | pin | use |
//! |---|---|
//! | PA4 | u: converter to volts |
//! | PA0 | y: converter from volts |
//! | PA2, PA3 | serial port of the USB connector, 2 Mbit/s |
//! | PA5 | the board's lamp: a sample took longer than its period |
#![no_std]
#![no_main]

mod control;
mod machine;

use control::{Control, Frames, Receiving, STOP, Sending, Slot};
use core::cell::RefCell;
use core::sync::atomic::Ordering;
use critical_section::Mutex;
use embassy_executor::Spawner;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::mode::Async;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::{RoundTo, Timer};
use embassy_stm32::usart::{self, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{bind_interrupts, dma, interrupt, pac, peripherals, rcc};
use static_cell::{ConstStaticCell, StaticCell};
use youla_link::{Key, LARGEST_PACKET, LARGEST_SIGNED, PacketReader, is_stop, write_packet};
use youla_rt::Checksum;

bind_interrupts!(struct Irqs {
    USART2 => usart::InterruptHandler<peripherals::USART2>;
    DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
});

/// On its way from `main` to the interrupt.
static CONTROL: Mutex<RefCell<Option<Control>>> = Mutex::new(RefCell::new(None));

#[interrupt]
fn TIM2() {
    static mut OWN: Option<Control> = None;
    if OWN.is_none() {
        *OWN = critical_section::with(|token| CONTROL.borrow_ref_mut(token).take());
    }
    if let Some(control) = OWN {
        control.sample();
    }
}

/// 160 MHz from the 8 MHz crystal of the board's debugger: the sample time is as exact as the crystal, 2 Mbit/s divide 40 MHz.
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    config.rcc.hse = Some(rcc::Hse { freq: Hertz(8_000_000), mode: rcc::HseMode::Bypass });
    config.rcc.pll_src = rcc::PllSource::HSE;
    config.rcc.pll = Some(rcc::Pll {
        prediv: rcc::PllPreDiv::DIV4,
        mul: rcc::PllMul::MUL160,
        divp: Some(rcc::PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV4;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    // Below the timer, which keeps priority 0.
    config.dma_interrupt_priority = Priority::P6;
    config
}

fn channel(slots: &'static mut [Slot], place: &'static StaticCell<Frames>) -> (Sending, Receiving) {
    place.init(Frames::new(slots)).split()
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    static FRAMES: StaticCell<Frames> = StaticCell::new();
    static REQUESTS: StaticCell<Frames> = StaticCell::new();
    static OUTGOING: ConstStaticCell<[Slot; 8]> = ConstStaticCell::new([Slot::EMPTY; 8]);
    static INCOMING: ConstStaticCell<[Slot; 4]> = ConstStaticCell::new([Slot::EMPTY; 4]);
    static BYTES: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);

    let p = embassy_stm32::init(clocks());
    let mut dac = DacChannel::new_blocking(p.DAC1, p.PA4);
    dac.set(Value::Bit12Right(machine::MIDDLE));
    let (frames, to_send) = channel(OUTGOING.take(), &FRAMES);
    let (received, requests) = channel(INCOMING.take(), &REQUESTS);

    let mut serial = usart::Config::default();
    serial.baudrate = 2_000_000;
    interrupt::USART2.set_priority(Priority::P6);
    let port = Uart::new(p.USART2, p.PA3, p.PA2, p.DMA1_CH6, p.DMA1_CH5, Irqs, serial);
    let (tx, rx) = port.expect("the rate divides the clock").split();
    spawner.spawn(send(tx, to_send).expect("spawned once"));
    spawner.spawn(receive(rx.into_ring_buffered(BYTES.take()), received).expect("spawned once"));

    let timer = Timer::new(p.TIM2);
    timer.set_frequency(Hertz(machine::RATE), RoundTo::Slower);
    timer.enable_update_interrupt(true);
    timer.start();
    let (mut adc, mut input) = (Adc::new(p.ADC1), p.PA0);
    let mut life = Checksum::new();
    // The part has no generator of random numbers: the noise of the converter in its place.
    for _ in 0..1024 {
        life.append(&adc.blocking_read(&mut input, SampleTime::CYCLES3).to_le_bytes());
    }
    let control = Control {
        rig: machine::rig(life.value()).expect("numbers of the machine"),
        timer,
        dac,
        adc,
        input,
        late: Output::new(p.PA5, Level::Low, Speed::Low),
        frames,
        requests,
        u: [0.0],
    };
    critical_section::with(|token| CONTROL.replace(token, Some(control)));
    interrupt::TIM2.set_priority(Priority::P0);
    // SAFETY: no critical section is open that the interrupt could break.
    unsafe { interrupt::TIM2.enable() };
}

/// Frames to the host, signed where the machine has a key, by DMA. The test of the constant keeps HMAC out of an image without a key.
#[embassy_executor::task]
async fn send(mut port: UartTx<'static, Async>, mut frames: Receiving) {
    let mut packet = [0; LARGEST_PACKET];
    let key = machine::KEY.map(|bytes| Key::new(&bytes));
    loop {
        let slot = frames.receive().await;
        let frame = slot.frame();
        let written = match &key {
            Some(key) if machine::KEY.is_some() && slot.signed => {
                let mut signed = [0; LARGEST_SIGNED];
                signed.iter_mut().zip(frame).for_each(|(to, from)| *to = *from);
                let length = key.sign(&mut signed, frame.len());
                length.and_then(|length| write_packet(signed.get(..length).unwrap_or_default(), &mut packet))
            }
            _ => write_packet(frame, &mut packet),
        };
        frames.receive_done();
        let bytes = written.ok().and_then(|length| packet.get(..length)).unwrap_or_default();
        // A packet that is damaged or lost shows in its checksum and its number.
        let _ = port.write(bytes).await;
    }
}

/// Requests of the host, from a ring that the DMA fills.
#[embassy_executor::task]
async fn receive(mut port: RingBufferedUartRx<'static>, mut requests: Sending) {
    let mut packets = PacketReader::new();
    let key = machine::KEY.map(|bytes| Key::new(&bytes));
    let mut bytes = [0; 64];
    loop {
        // After an error of the line the host asks again.
        let count = port.read(&mut bytes).await.unwrap_or(0);
        for byte in bytes.iter().take(count) {
            let Some(Ok(frame)) = packets.push(*byte) else { continue };
            // It waits for no place among the requests.
            if is_stop(frame) {
                STOP.store(true, Ordering::Relaxed);
            }
            let signed = machine::KEY.is_none() || key.as_ref().is_some_and(|key| key.verify(frame).is_ok());
            let slot = requests.send().await;
            slot.signed = signed;
            if slot.put(frame) {
                requests.send_done();
            }
        }
    }
}

/// The middle of the range, and no further sample.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    pac::DAC1.dhr12r(0).write(|register| register.set_dhr(machine::MIDDLE));
    loop {
        cortex_m::asm::wfi();
    }
}
